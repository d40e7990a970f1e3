"""A camera in a simulated scene, at the pose of the emulated head.

Its output is a detector's, not pixels: landmarks with noise, hands and things with their
distance. Detections arrive after a latency, at the camera's rate, inside its field of view, and
some are missed. Not modelled: motion blur, light, occlusion, false detections.
"""

from collections.abc import Callable
from math import cos, pi, radians

import numpy as np

from gazerig.drivers.camera.capture_loop import Locate
from gazerig.drivers.types import DetectedFace, Detections, FaceSigns, MovingBlob
from gazerig.gaze.angles import add, dot, norm, rotate, rotate_back, rotation, scale, sub, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount
from gazerig.sim_mock.cameras.frame_times import Begin, FrameParams, FrameTimes
from gazerig.sim_mock.scenes.scene import Scene, ScenePerson, Thing

_FARTHEST_FACE_M = 4.0
_LANDMARK_NOISE_PX, _DEPTH_NOISE_M, _MISSED_SHARE = 0.5, 0.005, 0.03
"""Quality of the detector: standard deviations, and the share of faces that it misses."""
_HAND_RADIUS_M = 0.07
_FIRST_THING_ID = 1000  # hands have the numbers of their people, from 0
_LEAST_SEEN_PX = 15.0
"""Width of the part of a thing that must be in the picture, unless its centre is."""
_FACE_BOX_M = 0.17
_LIPS_HZ, _LIPS_M = 4.5, 0.004
"""Frequency and amplitude of the gap between the lips of a person who speaks."""
_COS_TURNED_AWAY = cos(radians(60.0))
_LANDMARKS_FACE_M: tuple[Vec3, ...] = tuple((x, y, z) for x, y, z in LANDMARKS_FACE_M.tolist())


class SceneCamera:
    """A gazerig.drivers.types.Camera in a scene; frames are computed on demand.

    Args:
        params: resolution, rate and latency of the camera.
        scene: the scene in front of it.
        mount: pose of the camera on the head.
        head_pose: true rotation (3, 3) and position [m] of the head in the world at a time [s].
        rng: random numbers of the noise.
        locate: converts detections from pixels to the camera's axes; None: no conversion.
        begin: returns the start of the scene; None: at the first call of ``latest``.
    """

    def __init__(
        self,
        params: FrameParams,
        scene: Scene,
        mount: CameraMount,
        head_pose: Callable[[float], tuple[Mat3, Vec3]],
        rng: np.random.Generator,
        locate: Locate | None = None,
        begin: Begin | None = None,
    ) -> None:
        self._params = params
        self._scene = scene
        self._mount = mount
        self._head_pose = head_pose
        self._rng = rng
        self._locate = locate
        self._times = FrameTimes(params, begin)
        self._lens = params.lens

    @property
    def start_s(self) -> float | None:
        """Return the start of the scene; None if ``latest`` has not been called yet."""
        return self._times.start_s

    def open(self) -> None:
        """Start; the first frame is taken at the first call of ``latest``."""
        self._times.restart()

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived by ``now_s``."""
        scene_s = self._times.next_frame_s(now_s)
        if scene_s is not None:
            self._times.send(self._detect(now_s, scene_s).locate_in_camera(self._locate))
        return self._times.arrived(now_s)

    def events(self) -> tuple[str, ...]:
        """Return no events: none can happen."""
        return ()

    def close(self) -> None:
        """Stop; there is nothing to free."""

    def _detect(self, now_s: float, scene_s: float) -> Detections:
        R, p = self._mount.pose(*self._head_pose(now_s))
        faces: list[DetectedFace] = []
        blobs: list[MovingBlob] = []
        for index, person in enumerate(self._scene.people(scene_s)):
            face = self._face(person, R, p, scene_s)
            if face is not None:
                faces.append(face)
            if person.hand is not None:
                blobs.extend(self._blob(Thing(index, "hand", person.hand, _HAND_RADIUS_M), R, p))
        for thing in self._scene.things(scene_s):
            blobs.extend(self._blob(thing._replace(id=_FIRST_THING_ID + thing.id), R, p))
        faces.sort(key=lambda face: -face.box_px[2])
        par, number = self._params, self._times.number
        return Detections(now_s, number, par.width_px, par.height_px, tuple(faces), tuple(blobs))

    def _face(self, person: ScenePerson, R: Mat3, p: Vec3, scene_s: float) -> DetectedFace | None:
        """Project the landmarks; a face that is cut off, far or turned away is not detected."""
        noise = self._rng.normal(0.0, _LANDMARK_NOISE_PX, (5, 2))
        missed = self._rng.random() < _MISSED_SHARE
        yaw, pitch = person.face_yaw_pitch_rad
        R_world_face = rotation((yaw, pitch, 0.0))
        place = person.p_world_face_m
        to_camera = sub(p, place)
        outwards = rotate(R_world_face, (1.0, 0.0, 0.0))
        turned_away = dot(unit(to_camera), outwards) < _COS_TURNED_AWAY
        if missed or turned_away or norm(to_camera) > _FARTHEST_FACE_M:
            return None
        points = [
            rotate_back(R, sub(add(place, rotate(R_world_face, one)), p))
            for one in _LANDMARKS_FACE_M
        ]
        if min([z for _, _, z in points]) < 0.1:
            return None
        pixels = [self._pixel(point) for point in points]
        size = self._lens.fx_px * _FACE_BOX_M / points[2][2]
        x, y = pixels[2]
        box = (x - size / 2, y - size / 2, size, size)
        if not self._is_inside(x, y, size / 2):
            return None
        lips_m = _LIPS_M * (1.0 - cos(2.0 * pi * _LIPS_HZ * scene_s)) if person.speaks else 0.0
        signs = FaceSigns(None, lips_m)
        return DetectedFace(box, np.array(pixels) + noise, 0.98, signs=signs)

    def _blob(self, thing: Thing, R: Mat3, p: Vec3) -> tuple[MovingBlob, ...]:
        """Project a hand or thing; nothing if it is behind the camera or outside the frame."""
        noise = self._rng.normal(0.0, _DEPTH_NOISE_M)
        point = rotate_back(R, sub(thing.p_world_m, p))
        if point[2] < 0.1:
            return ()
        seen_px = thing.radius_m / point[2] * self._lens.fx_px - _LEAST_SEEN_PX
        if not self._is_inside(*self._pixel(point), -max(0.0, seen_px)):
            return ()
        place = scale(point, 1.0 + noise / norm(point))
        return (MovingBlob(thing.id, thing.kind, place, thing.radius_m, thing.spin_rad_s),)

    def _pixel(self, point: Vec3) -> tuple[float, float]:
        x, y, z = point
        return (
            x / z * self._lens.fx_px + self._lens.cx_px,
            y / z * self._lens.fy_px + self._lens.cy_px,
        )

    def _is_inside(self, x: float, y: float, margin: float) -> bool:
        par = self._params
        return margin <= x <= par.width_px - margin and margin <= y <= par.height_px - margin
