"""Cost of a world's pictures, and detections in them: bench_world.py [--quick]

Processor time of a picture by renderer, size and content, and of lens, exposure and rolling
shutter; faces found by distance, yaw, detector and look, with the errors of their landmarks and
poses; detections of motion in an idle room and of a person who waves; error of the gaze from the
true faces in a whole run, from servo bytes to pictures and back.
Milliseconds are processor time, the least of some rounds. YuNet takes part where its file is
(--yunet FILE). MUJOCO_GL chooses the renderer.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from math import degrees, radians
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))

from bench.gaze_misses import looked, text  # noqa: E402
from posed_people import (  # noqa: E402
    CAMERA_M,
    OPTICAL,
    Found,
    PosedPeople,
    look_for,
    mean_abs_deg,
    poses,
    rms_px,
    watch_motion,
)
from rendering import why_not  # noqa: E402

from gazerig.config.load import load, shipped_path  # noqa: E402
from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view  # noqa: E402
from gazerig.drivers.types import FaceDetector  # noqa: E402
from gazerig.drivers.vision.face.detector import face_detector  # noqa: E402
from gazerig.drivers.vision.face.params import FaceDetectorParams  # noqa: E402
from gazerig.features.world.figure import Figures  # noqa: E402
from gazerig.features.world.world_scene import WorldScene  # noqa: E402
from gazerig.gaze.angles import compose, rotation  # noqa: E402
from gazerig.gaze.types import Mat3  # noqa: E402
from gazerig.robot.model.intrinsics import project  # noqa: E402
from gazerig.robot.model.scene_view import PinholeView  # noqa: E402
from gazerig.sim_mock.cameras.optics import CameraMotion, OpticsParams, expose  # noqa: E402
from gazerig.sim_mock.scenes.scene import ScenePerson  # noqa: E402
from gazerig.sim_mock.scenes.script import (  # noqa: E402
    HOME,  # noqa: E402
    Act,
    PersonScript,
    PlaceScript,
    SceneScript,
)

if TYPE_CHECKING:
    from gazerig.features.world.renderer import WorldPicture

YUNET_FILE = TESTS.parents[1] / "shared" / "models" / "face_detection_yunet_2026may.onnx"
AWAY_M = (0.6, 1.0, 1.5, 2.0, 2.5, 3.0)
YAW_DEG = (-60, -45, -30, -15, 0, 15, 30, 45, 60)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, looks and poses")
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=list(PARTS))
    parser.add_argument("--yunet", type=Path, default=YUNET_FILE)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    if reason := why_not():
        raise SystemExit(reason)
    for name in args.parts:
        PARTS[name](args)


def costs(args: argparse.Namespace) -> None:
    """Print what a picture costs by size and by what it shows."""
    from gazerig.features.world.renderer import RendererParams

    rounds = 5 if args.quick else 15
    shown = {
        "plain": RendererParams(0, 0, False, False),
        "+ sky": RendererParams(0, 0),
        "+ 4 samples": RendererParams(0, 4),
        "+ mirrors": RendererParams(0, 0, True),
        "+ shadow 512": RendererParams(512, 0),
        "+ shadow 1024": RendererParams(1024, 0),
        "+ shadow 4096": RendererParams(4096, 0),
        "samples, shadow": RendererParams(512, 4),
    }
    print("\nms a picture (processor), by people in it")
    print(f"{'':18}" + "".join(f"{w:>5}x{h:<4}" * 3 for w, h in ((320, 240), (640, 400))))
    print(f"{'':18}" + "".join(f"{n:>9} " for n in (0, 1, 3)) * 2)
    rows: dict[str, list[float]] = {name: [] for name in shown}
    for size in ((320, 240), (640, 400)):
        for count in (0, 1, 3):
            for name, params in shown.items():
                people = PosedPeople(
                    range(max(count, 1)), size, params=params, shadows="shadow" in name
                )
                people.gather(count)
                rows[name].append(_least_ms(people.draw, rounds))
                backend = people.picture.backend
                people.close()
    for name, row in rows.items():
        print(f"{name:18}" + "".join(f"{one:9.1f} " for one in row))
    print(f"renderer: {backend}")


def lens_costs(args: argparse.Namespace) -> None:
    """Print what lens, exposure and rolling shutter cost."""
    rounds = 5 if args.quick else 15
    picture = _one_person()
    lens = intrinsics_of_view(radians(69.0), 320, 240)
    bent = Intrinsics(lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, (-0.28, 0.08, 0.0, 0.0, 0.0))
    before = compose(rotation((-0.02, 0.0, 0.0)), OPTICAL)
    motion = CameraMotion(OPTICAL, CAMERA_M, before, CAMERA_M, 0.005)  # 230 deg/s
    still = motion._replace(span_s=0.0)
    cases: dict[str, tuple[OpticsParams, Intrinsics, CameraMotion, bool]] = {
        "as it is": (OpticsParams(), lens, still, False),
        "with distances": (OpticsParams(), lens, still, True),
        "distortion": (OpticsParams(), bent, still, False),
        "smear of a turn": (OpticsParams(), lens, motion, False),
        "4 sub-exposures": (OpticsParams(sub_exposures=4), lens, motion, False),
        "8 sub-exposures": (OpticsParams(sub_exposures=8), lens, motion, False),
        "rolling shutter, 8 bands": (OpticsParams(read_out_ms=15.0), lens, motion, False),
        "rolling shutter, 4 bands": (OpticsParams(read_out_ms=15.0, bands=4), lens, motion, False),
    }
    print("\nms a picture of 320 x 240 with one person (processor), by what the camera adds")
    for name, (params, through, moving, depth) in cases.items():

        def take(
            params: OpticsParams = params,
            through: Intrinsics = through,
            moving: CameraMotion = moving,
            depth: bool = depth,
        ) -> None:
            expose(picture, params, 1.0, through, (320, 240), moving, depth=depth)

        print(f"{name:26}{_least_ms(take, rounds):7.1f}")
    picture.close()


def _one_person() -> "WorldPicture":
    """Return a room with one person who is at 1.2 m and does nothing."""
    script = SceneScript({"p": PersonScript("there")}, places={"there": PlaceScript(1.2, 0.0)})
    return _played(script)


def _played(script: SceneScript) -> "WorldPicture":
    """Return pictures of a script."""
    from gazerig.features.world.figure import Figures
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.model import world_model
    from gazerig.features.world.renderer import WorldPicture

    figures = Figures(script, 0)
    model = world_model(figures, ()).mj
    return WorldPicture(model, PeoplePlacer(model, figures).place)


def faces(args: argparse.Namespace) -> None:
    """Print how many faces are found, and how near they are to the truth."""
    looks, each = range(8), 1 if args.quick else 2
    people = PosedPeople(looks)
    found: dict[tuple[str, float, float, int], list[Found | None]] = {}
    yaws = (-60, -30, 0, 30, 60) if args.quick else YAW_DEG
    away = (0.6, 1.5, 2.5) if args.quick else AWAY_M
    detectors = _detectors(args.yunet)
    for pose in poses(looks, away, yaws, each):
        wanted = min(yaws, key=lambda yaw: abs(radians(yaw) - pose.yaw))
        for name, detector in detectors.items():
            key = (name, pose.away_m, wanted, pose.look)
            found.setdefault(key, []).append(look_for(people, pose, detector))
    people.close()
    for name in detectors:
        print(
            f"\n{name}: found % / landmarks rms px / |yaw|, |pitch| error deg, by distance and yaw"
        )
        print("       " + "".join(f"{yaw:>18}" for yaw in yaws))
        for metres in away:
            print(f"{metres:4.1f} m " + "".join(f"{_cell(found, name, metres, y)}" for y in yaws))
        frontal = [_rate(found, name, away, (0,), (look,)) for look in looks]
        print("frontal, by look:  " + "  ".join(f"{one:.0f}" for one in frontal))


def _cell(
    found: dict[tuple[str, float, float, int], list[Found | None]],
    name: str,
    metres: float,
    yaw: float,
) -> str:
    every = [f for key, row in found.items() if key[:3] == (name, metres, yaw) for f in row]
    hits = [one for one in every if one is not None]
    if not hits:
        return f"{'0':>18}"
    off = mean_abs_deg([one.yaw_rad for one in hits]), mean_abs_deg([o.pitch_rad for o in hits])
    share = 100.0 * len(hits) / len(every)
    return f"{share:4.0f} {rms_px(hits):4.1f} {off[0]:3.0f} {off[1]:3.0f}  "


def _rate(
    found: dict[tuple[str, float, float, int], list[Found | None]],
    name: str,
    away: Sequence[float],
    yaws: Sequence[float],
    looks: Sequence[int],
) -> float:
    every = [
        one is not None
        for key, row in found.items()
        if key[0] == name and key[1] in away and key[2] in yaws and key[3] in looks
        for one in row
    ]
    return 100.0 * float(np.mean(every))


def _detectors(yunet: Path) -> dict[str, FaceDetector]:
    """Return the detectors: as they come, and with the whole width and smaller faces."""
    found = {
        "mtcnn": FaceDetectorParams(kind="mtcnn"),
        "mtcnn, 640 px wide": FaceDetectorParams(kind="mtcnn", work_width_px=640),
    }
    if yunet.exists():
        file = str(yunet)
        found["yunet"] = FaceDetectorParams(kind="yunet", model_file=file)
        found["yunet, 640 px wide"] = FaceDetectorParams(
            kind="yunet", model_file=file, work_width_px=640
        )
    return {name: face_detector(params) for name, params in found.items()}


def motion(args: argparse.Namespace) -> None:
    """Print detections of motion in an empty room, and of a person who waves."""
    from gazerig.features.world.renderer import RendererParams

    seconds = 4.0 if args.quick else 12.0
    waves = tuple(Act(at_s=at, do="wave", for_s=2.4) for at in np.arange(0.5, seconds - 2.5, 3.0))
    nobody = SceneScript(people={"p": PersonScript("door")}, round_s=seconds)
    somebody = SceneScript(
        people={"p": PersonScript("there", acts=waves)},
        round_s=seconds,
        places={"there": PlaceScript(1.9, 0.0)},
    )
    print("\nmotion at 30 Hz: blobs a picture; waving hand found in % of its pictures")
    for size, samples in (((320, 240), 0), ((320, 240), 4), ((640, 400), 0), ((640, 400), 4)):
        for name, turn in (("head stands", 0.0), ("head turns 40 deg/s", 1.0)):
            params = RendererParams(512, samples)
            _, blobs, _ = watch_motion(nobody, seconds, turn, params, size)
            found, others, _ = watch_motion(somebody, seconds, turn, params, size)
            print(
                f"{size[0]} x {size[1]}, {samples} samples, {name:20} empty room {blobs:.3f}; "
                f"hand {100 * found:.0f} %, beside it {others:.2f}"
            )


def scripts(args: argparse.Namespace) -> None:
    """Print how many faces are found in moments of the shipped worlds, and how many are none."""
    moments = 10 if args.quick else 24
    print(f"\nfaces in {moments} moments of each world, 320 x 240: found, of, false")
    lens = intrinsics_of_view(radians(69.0), 320, 240)
    for name in ("living-room", "conversation", "boxing", "crowd"):
        found = {key: np.zeros(3, int) for key in _detectors(args.yunet) if "640" not in key}
        rng = np.random.default_rng(0)
        script = load(shipped_path("worlds", name, HOME), SceneScript)
        picture = _played(script)
        scene = WorldScene(name, Figures(script, 0))
        detectors = _detectors(args.yunet)
        for t_s in np.linspace(1.0, script.round_s - 1.0, moments):
            R = compose(rotation((float(rng.uniform(-0.4, 0.4)), 0.1, 0.0)), OPTICAL)
            image = picture.draw(PinholeView(float(t_s), lens, (320, 240), R, CAMERA_M)).image
            noise = rng.normal(0.0, 3.0, image.shape).astype(np.float32)
            image = cv2.add(image, noise, dtype=cv2.CV_8U).astype(np.uint8)
            true = [_seen(one, R, lens) for one in scene.people(float(t_s))]
            for key, count in found.items():
                noses = [face.landmarks_px[2] for face in detectors[key].find(image)]
                at = [[np.hypot(*(nose - one.place_px)) < 30.0 / one.away_m for nose in noses]
                      for one in true]  # fmt: skip
                wanted = [near for one, near in zip(true, at, strict=True) if one.plain]
                none = sum(not any(row[i] for row in at) for i in range(len(noses)))
                count += (sum(map(any, wanted)), len(wanted), none)
        picture.close()
        print(f"{name:14}" + "; ".join(f"{key} {row}" for key, row in found.items()))


class _Seen(NamedTuple):
    """A face: its place in the picture; plain: near, in the picture and hardly turned away."""

    place_px: np.ndarray
    away_m: float
    plain: bool


def _seen(person: ScenePerson, R: Mat3, lens: Intrinsics) -> _Seen:
    nose = (np.array(person.p_world_face_m) - CAMERA_M) @ np.array(R)
    away = float(np.linalg.norm(nose))
    if nose[2] < 0.3:
        return _Seen(np.full(2, np.inf), away, False)
    place = project(nose, lens)[0]
    back = np.subtract(CAMERA_M, person.p_world_face_m) / away
    ahead = np.array(rotation((*person.face_yaw_pitch_rad, 0.0)))[:, 0]
    inside = bool((place > 15.0).all() and (place < (305.0, 225.0)).all())
    turned = degrees(float(np.arccos(np.clip(back @ ahead, -1.0, 1.0))))
    return _Seen(place, away, inside and 0.55 < away < 1.8 and turned < 35.0)


def gaze(args: argparse.Namespace) -> None:
    """Print how far the gaze is off the true faces, through pictures and without."""
    seconds = 8.0 if args.quick else 24.0
    print(f"\ngaze off the true part of the face, deg, in {seconds:g} s of the conversation")
    for name, blind in (("rendered pictures", False), ("computed detections", True)):
        print(text(name, *looked(seconds, blind)))


def _least_ms(work: Callable[[], object], rounds: int) -> float:
    """Return the least processor time of a call, milliseconds; the first is not counted."""
    work()
    spent = []
    for _ in range(rounds):
        began = time.process_time()
        work()
        spent.append(time.process_time() - began)
    return 1e3 * min(spent)


PARTS: dict[str, Callable[[argparse.Namespace], None]] = {
    "cost": costs,
    "lens": lens_costs,
    "faces": faces,
    "motion": motion,
    "scripts": scripts,
    "gaze": gaze,
}


if __name__ == "__main__":
    main()
