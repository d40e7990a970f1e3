"""Figures of a world, each held with its face at a wanted pose before a camera, and the truth."""

from collections.abc import Iterator, Sequence
from math import asin, atan2, cos, degrees, pi, radians, sin
from typing import Any, NamedTuple

import cv2
import numpy as np

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import DetectedFace, FaceDetector, ImageArray
from gazerig.features.world.gl_context import import_mujoco
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M, PUPIL_DISTANCE_M
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.scene_view import PinholeView
from gazerig.robot.perception.face_pose import face_pose
from gazerig.sim_mock.scenes.script import Act, LightParams, PersonScript, SceneScript

OPTICAL: Mat3 = ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
CAMERA_M: Vec3 = (0.10, 0.0, 0.20)
"""Where the camera is, about as high as that of a shipped rig."""
_AWAY_M = (0.0, 0.0, -9.0)
_ROUND_S = 12.0
_TURNING = ("head", "lips", "left_eye", "right_eye", "left_lid", "right_lid")


class Pose(NamedTuple):
    """A face before the camera.

    away_m: of the tip of the nose; aside_rad: to the camera's left; up_m: above the axis
    yaw, pitch, roll: off the line to the camera, rad
    t_s: time of the script, for lips and lids
    """

    look: int
    away_m: float
    aside_rad: float
    up_m: float
    yaw: float
    pitch: float
    roll: float
    t_s: float


class PosedPeople:
    """A world with one figure of each look, of which one at a time is before the camera."""

    def __init__(
        self,
        looks: Sequence[int],
        size_px: tuple[int, int] = (640, 400),
        noise_grey: float = 3.0,
        params: Any = None,
        shadows: bool = False,
    ) -> None:
        import_mujoco()
        from gazerig.features.world.figure import Figures
        from gazerig.features.world.figure_model import PeoplePlacer
        from gazerig.features.world.model import world_model
        from gazerig.features.world.renderer import WorldPicture

        speaks = (Act(at_s=0.5, do="speak", for_s=_ROUND_S - 1.0),)
        people = {f"p{n}": PersonScript("front", n, acts=speaks) for n in looks}
        light = LightParams(shadows=shadows)
        self.figures = Figures(SceneScript(people, round_s=_ROUND_S, light=light), 1)
        self.model = world_model(self.figures, ()).mj
        self._people = PeoplePlacer(self.model, self.figures)
        self.size_px, self._noise = size_px, noise_grey
        self.lens = intrinsics_of_view(radians(69.0), *size_px)
        self._rng = np.random.default_rng(2)
        self._pose: Pose | None = None
        self._placed: tuple[Pose | None, float] | None = None
        self.picture = WorldPicture(self.model, self._place, params)

    def show(self, pose: Pose) -> ImageArray:
        """Return what the camera sees of a face."""
        self._pose = pose
        image = self.picture.draw(
            PinholeView(pose.t_s, self.lens, self.size_px, OPTICAL, CAMERA_M)
        ).image
        noise = self._rng.normal(0.0, self._noise, image.shape).astype(np.float32)
        noisy: ImageArray = cv2.add(image, noise, dtype=cv2.CV_8U).astype(np.uint8)
        return noisy

    def face(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return rotation and place of a face in the world."""
        y, x = pose.away_m * sin(pose.aside_rad), pose.away_m * cos(pose.aside_rad)
        p = np.array(CAMERA_M) + (x, y, pose.up_m)
        turn = rotation((pi + pose.aside_rad + pose.yaw, pose.pitch, pose.roll))
        return np.array(turn), p

    def landmarks_px(self, pose: Pose) -> Floats:
        """Return the true positions of the five landmarks."""
        R, p = self.face(pose)
        size = self.figures.measures[f"p{pose.look}"].head_scale
        marks = size * LANDMARKS_FACE_M @ R.T + p
        return project((marks - CAMERA_M) @ np.array(OPTICAL), self.lens)

    def eyes_px(self, pose: Pose) -> float:
        """Return how far the pupils would be apart in the picture if the face were frontal."""
        return PUPIL_DISTANCE_M * self.lens.fx_px / pose.away_m

    def close(self) -> None:
        """Free the renderer."""
        self.picture.close()

    def _place(self, data: Any, t_s: float) -> None:
        if (now := (self._pose, t_s)) == self._placed:
            return
        self._placed = now
        self._people.place(data, t_s)
        shown = [] if self._pose is None else [self._pose]
        poses = {f"p{pose.look}": self._moved(pose, t_s) for pose in shown}
        for segment, at in self.figures.row.items():
            name, part = segment.split("/")
            number = self.model.body_mocapid[self.model.body(segment).id]
            if name not in poses:
                data.mocap_pos[number] = _AWAY_M
                continue
            found = self.figures.segments(t_s)
            skull, p_head, head, body = poses[name]
            turn = head if part in _TURNING else body
            data.mocap_pos[number] = skull + turn @ (found.p_m[at] - p_head)
            from scipy.spatial.transform import Rotation

            R = Rotation.from_matrix(turn @ _matrix(found.quat[at]))
            data.mocap_quat[number] = R.as_quat(scalar_first=True)

    def _moved(self, pose: Pose, t_s: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return position of the head's joint, target position, and turns of head and body."""
        name = f"p{pose.look}"
        found = self.figures.segments(t_s)
        R_face, p_face = self.face(pose)
        row = self.figures.row[f"{name}/head"]
        R_head = _matrix(found.quat[row])
        body_yaw = atan2(R_face[1, 0], R_face[0, 0]) - pose.yaw
        turn = np.array(rotation((body_yaw - atan2(R_head[1, 0], R_head[0, 0]), 0.0, 0.0)))
        skull = p_face + R_face @ np.array(self.figures.measures[name].skull_m)
        return skull, found.p_m[row], R_face @ R_head.T, turn


def _matrix(quat: Floats) -> Floats:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quat, scalar_first=True).as_matrix())


class Found(NamedTuple):
    """Error of a detected face.

    off_px: (5, 2) of its landmarks; yaw_rad, pitch_rad: of the face, None without a pose
    """

    off_px: Floats
    yaw_rad: float | None
    pitch_rad: float | None


def look_for(people: PosedPeople, pose: Pose, detector: FaceDetector) -> Found | None:
    """Return how well a detector finds a face; None: not at all."""
    faces = detector.find(people.show(pose))
    return nearest(people, pose, faces)


def nearest(people: PosedPeople, pose: Pose, faces: Sequence[DetectedFace]) -> Found | None:
    """Return how near the nearest of the found faces is; None where none is at the face."""
    true = people.landmarks_px(pose)
    size = people.eyes_px(pose)
    off = [np.asarray(face.landmarks_px) - true for face in faces]
    off = [one for one in off if np.sqrt((one**2).sum(axis=1).mean()) < size]
    if not off:
        return None
    best = min(off, key=lambda one: float((one**2).sum()))
    seen = face_pose(true + best, people.lens)
    if seen is None:
        return Found(best, None, None)
    ahead = (np.array(OPTICAL) @ np.array(seen.R_camera_face))[:, 0]
    R, _ = people.face(pose)
    yaw = atan2(ahead[1], ahead[0]) - atan2(R[1, 0], R[0, 0])
    return Found(best, (yaw + pi) % (2 * pi) - pi, asin(ahead[2]) - asin(R[2, 0]))


def poses(
    looks: Sequence[int],
    away_m: Sequence[float],
    yaw_deg: Sequence[float],
    each: int,
    seed: int = 3,
) -> Iterator[Pose]:
    """Yield poses about each look, distance and yaw: a little aside, up, nodding, at any time."""
    rng = np.random.default_rng(seed)
    for look in looks:
        for away in away_m:
            for yaw in yaw_deg:
                for _ in range(each):
                    aside, up, off, nod, tilt, t = rng.uniform(-1.0, 1.0, 6)
                    yield Pose(
                        look,
                        away,
                        radians(12.0 * aside),
                        0.07 * up * away,
                        radians(yaw + 4.0 * off),
                        radians(7.0 * nod),
                        radians(5.0 * tilt),
                        0.5 * _ROUND_S * (1.0 + t),
                    )


def rms_px(found: Sequence[Found]) -> float:
    """Return the root of the mean squared distance of landmarks."""
    return float(np.sqrt(np.mean([(one.off_px**2).sum(axis=1) for one in found])))


def mean_abs_deg(values: Sequence[float | None]) -> float:
    """Return the mean size of angles, those that are not there left out."""
    there = [abs(degrees(one)) for one in values if one is not None]
    return float(np.mean(there)) if there else float("nan")
