"""A camera that renders the view from the emulated head and runs the real detectors on it.

gazerig.sim_mock.cameras.detections simulates what a detector would find; here the real
detectors work on pixels: a room with texture, people with faces and arms, things, distances.
Frames come late, at their own rate, noisy, and smeared by the camera's turn during the
exposure; a depth frame has the noise of stereo and holes at edges. Not modelled: lens
distortion, rolling shutter, light, the smear of things that move themselves.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, radians
from typing import Annotated, Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.frame_analysis import Locate
from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.types import Detections, FaceDetector, ImageArray, MovingBlob
from gazerig.gaze.angles import norm, rotate_back, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.frames import CameraMount
from gazerig.sim_mock.cameras.canvas import Canvas
from gazerig.sim_mock.cameras.draw_person import draw_arm_of, draw_person, draw_thing
from gazerig.sim_mock.cameras.draw_room import draw_room
from gazerig.sim_mock.scenes.scene import PLANNED_KINDS, Scene, Thing

_HAND_RADIUS_M = 0.07
_FIRST_THING_ID = 1000  # hands have the numbers of their people, from 0
_FIRST_PLANNED_ID = 1_000_000  # beyond the numbers of the motion detector
_BEHIND_HAND_M = 1e-3  # an arm is drawn right before its hand
# A second of noise would cost more than the drawing; a piece of one stock is as good.
_NOISE_STOCK = 1 << 21
# Stereo is blind beside edges: over so many pixels, where the distance jumps by this share.
_BLIND_PX, _JUMP = 5, 0.08


class Exposure(NamedTuple):
    """One frame as taken.

    image: (h, w, 3) BGR; depth_m: (h, w) metres along the axis, NaN in holes, None without
    R_world_camera, p_world_camera_m: where the camera truly was
    """

    captured_s: float
    number: int
    image: ImageArray
    depth_m: NDArray[np.float32] | None
    R_world_camera: Mat3
    p_world_camera_m: Vec3


FindMotion = Callable[[Exposure, Intrinsics], tuple[MovingBlob, ...]]
"""Finds what moves since the exposure before."""


@dataclass(frozen=True)
class PixelCameraParams:
    """How good the camera is."""

    width_px: Annotated[int, Bounds(32, 4096)] = 640
    height_px: Annotated[int, Bounds(32, 4096)] = 400
    horizontal_field_deg: Annotated[float, Bounds(10, 150)] = 69.0
    rate_hz: Annotated[float, Bounds(1, 240)] = 30.0
    latency_ms: Annotated[float, Bounds(0, 1000)] = 60.0
    exposure_ms: Annotated[float, Bounds(0, 100)] = 8.0
    noise_grey: Annotated[float, Bounds(0, 60)] = 3.0
    depth: Annotated[bool, "it measures depth, too"] = False
    depth_noise_1_m: Annotated[float, Bounds(0, 0.2)] = 0.004
    room_seed: Annotated[int, Bounds(0, 1 << 30)] = 0


class PixelCamera:
    """A gazerig.drivers.types.Camera in a drawn scene; frames are computed on demand.

    Args:
        params: resolution, rate and noise of the camera.
        scene: what is in front of it.
        mount: where the camera sits on the head.
        head_pose: true rotation (3, 3) and position [m] of the head in the world at a time [s].
        detector: finds the faces.
        rng: for the noise.
        find_motion: finds what moves, besides the faces.
        locate: locates what is found in the camera's axes, None for none.
    """

    def __init__(
        self,
        params: PixelCameraParams,
        scene: Scene,
        mount: CameraMount,
        head_pose: Callable[[float], tuple[Mat3, Vec3]],
        detector: FaceDetector,
        rng: np.random.Generator,
        find_motion: FindMotion | None = None,
        locate: Locate | None = None,
    ) -> None:
        self._params = params
        self._scene = scene
        self._mount = mount
        self._head_pose = head_pose
        self._detector = detector
        self._rng = rng
        self._find_motion = find_motion
        self._locate = locate
        self.lens = intrinsics_of_view(
            radians(params.horizontal_field_deg), params.width_px, params.height_px
        )
        self._noise = rng.standard_normal(_NOISE_STOCK, dtype=np.float32) * params.noise_grey
        self.open()

    def open(self) -> None:
        """Start: the first frame is taken at the first look."""
        self._on_the_way: deque[Detections] = deque()
        self._arrived: Detections | None = None
        self._start_s: float | None = None
        self._number = 0
        self._before: tuple[float, Mat3] | None = None

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived by ``now_s``."""
        if self._start_s is None:
            self._start_s = now_s
        R, p = self._mount.pose(*self._head_pose(now_s))
        if now_s >= self._start_s + self._number / self._params.rate_hz - 1e-9:
            # A late look skips the frames it missed, as a real camera's slot does.
            due = int((now_s - self._start_s) * self._params.rate_hz + 1e-6)
            self._number = max(self._number, due) + 1
            self._on_the_way.append(self._looked_at(self._expose(now_s, R, p)))
        self._before = now_s, R
        late_s = self._params.latency_ms / 1e3
        while self._on_the_way and now_s >= self._on_the_way[0].captured_s + late_s - 1e-9:
            self._arrived = self._on_the_way.popleft()
        return self._arrived

    def retune(
        self,
        detector: Callable[[], FaceDetector] | None,
        motion: Callable[[FindMotion | None], FindMotion | None] | None,
        locate: Locate | None = None,
    ) -> bool:
        """Change detectors and calibration from the next frame on; always possible.

        Args:
            detector: makes another one; None: no change.
            motion: returns a motion detector from the present one; None: no change.
            locate: locates by another calibration; None: no change.

        Raises:
            SetupError: the detector cannot be made; the old one goes on.
        """
        if locate is not None:
            self._locate = locate
        if motion is not None:
            self._find_motion = motion(self._find_motion)
        if detector is not None:
            self._detector = detector()
        return True

    def events(self) -> tuple[str, ...]:
        """Return what the detector has to tell since the last call: nothing else can happen."""
        events = getattr(self._detector, "events", None)
        return events() if events is not None else ()

    def close(self) -> None:
        """Stop; there is nothing to free."""

    def _looked_at(self, shot: Exposure) -> Detections:
        """Return the detections in a frame."""
        blobs = self._find_motion(shot, self.lens) if self._find_motion is not None else ()
        blobs = (*blobs, *self._planned(shot))
        height, width = shot.image.shape[:2]
        found = Detections(
            shot.captured_s,
            shot.number,
            width,
            height,
            self._detector.find(shot.image),
            blobs,
            image=shot.image,
            depth_m=shot.depth_m,
        )
        return found.located_by(self._locate)

    def _planned(self, shot: Exposure) -> tuple[MovingBlob, ...]:
        """Return the places that the scene's planner names, where they are in the frame.

        The planner is the robot's own: what it means is known to it, not seen.
        """
        assert self._start_s is not None
        height, width = shot.image.shape[:2]
        found = []
        for thing in self._scene.things(shot.captured_s - self._start_s):
            if thing.kind not in PLANNED_KINDS:
                continue
            x, y, z = rotate_back(shot.R_world_camera, sub(thing.p_world_m, shot.p_world_camera_m))
            lens = self.lens
            inside = z > 0.1 and (
                0.0 <= x / z * lens.fx_px + lens.cx_px <= width
                and 0.0 <= y / z * lens.fy_px + lens.cy_px <= height
            )
            if inside:
                number = _FIRST_PLANNED_ID + thing.id
                found.append(MovingBlob(number, thing.kind, (x, y, z), thing.radius_m))
        return tuple(found)

    def _expose(self, t_s: float, R: Mat3, p: Vec3) -> Exposure:
        """Render one frame from the camera's pose; its time is the middle of the exposure."""
        assert self._start_s is not None
        par = self._params
        canvas = Canvas(par.width_px, par.height_px, self.lens, R, p)
        draw_scene(canvas, self._scene, t_s - self._start_s, par.room_seed)
        image = self._noisy(smeared(canvas.image, self._smear_px(t_s, R)))
        image.setflags(write=False)  # as those of real cameras
        depth = self._stereo(canvas.depth_m) if par.depth else None
        return Exposure(t_s, self._number, image, depth, R, p)

    def _smear_px(self, t_s: float, R: Mat3) -> tuple[float, float]:
        """Return how far the frame's middle moves during the exposure."""
        if self._before is None or t_s <= self._before[0]:
            return 0.0, 0.0
        before_s, R_before = self._before
        ahead = np.array(R_before).T @ np.array(R)[:, 2]
        share = self._params.exposure_ms / 1e3 / (t_s - before_s)
        lens = self.lens
        return (
            float(-ahead[0] / ahead[2]) * lens.fx_px * share,
            float(-ahead[1] / ahead[2]) * lens.fy_px * share,
        )

    def _noisy(self, image: NDArray[np.uint8]) -> ImageArray:
        """Add the sensor's noise."""
        if self._params.noise_grey <= 0.0:
            return image
        noise = self._piece(image.size).reshape(image.shape)
        out: ImageArray = cv2.add(image, noise, dtype=cv2.CV_8U).astype(np.uint8, copy=False)
        return out

    def _stereo(self, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return distances as stereo measures them: error with the square, blind beside edges."""
        noise = self._piece(depth_m.size).reshape(depth_m.shape)
        noise = noise * (self._params.depth_noise_1_m / max(self._params.noise_grey, 1e-9))
        seen = depth_m * (1.0 + depth_m * noise)
        kernel = np.ones((_BLIND_PX, _BLIND_PX), np.uint8)
        step = cv2.dilate(depth_m, kernel) - cv2.erode(depth_m, kernel)
        blind = ~(step < _JUMP * depth_m)
        out: NDArray[np.float32] = np.where(blind, np.float32(np.nan), seen).astype(np.float32)
        return out

    def _piece(self, size: int) -> NDArray[np.float32]:
        """Return a slice of the prepared noise, another one each time."""
        start = int(self._rng.integers(0, _NOISE_STOCK))
        return np.take(self._noise, np.arange(start, start + size), mode="wrap")


def draw_scene(canvas: Canvas, scene: Scene, scene_s: float, room_seed: int = 0) -> None:
    """Draw a room and who and what is in it, the farthest first."""
    draw_room(canvas, room_seed)
    eye = (float(canvas.p_m[0]), float(canvas.p_m[1]), float(canvas.p_m[2]))
    drawn: list[tuple[float, Callable[[], None]]] = []
    people = scene.people(scene_s)
    things = [
        thing._replace(id=_FIRST_THING_ID + thing.id)
        for thing in scene.things(scene_s)
        if thing.kind not in PLANNED_KINDS
    ]
    for number, person in enumerate(people):
        away = norm(sub(person.p_world_face_m, eye))
        drawn.append((away, _later(draw_person, canvas, person, number)))
        if person.hand is not None:
            things.append(Thing(number, "hand", person.hand, _HAND_RADIUS_M, person=number))
    for thing in things:
        away = norm(sub(thing.p_world_m, eye))
        if thing.person is not None:
            draw = _later(draw_arm_of, canvas, people[thing.person], thing.person, thing.p_world_m)
            drawn.append((away + _BEHIND_HAND_M, draw))
        drawn.append((away, _later(draw_thing, canvas, thing)))
    for _, draw in sorted(drawn, key=lambda item: -item[0]):
        draw()


def smeared(image: NDArray[np.uint8], way_px: tuple[float, float]) -> NDArray[np.uint8]:
    """Blur a frame evenly along a displacement (x, y) in pixels."""
    length = hypot(*way_px)
    if length < 1.0:
        return image
    half = int(np.ceil(0.5 * length))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    # Looks spread evenly over the way, each shared among the four pixels around it.
    for share in np.linspace(-0.5, 0.5, 4 * half + 1).tolist():
        x, y = half + share * way_px[0], half + share * way_px[1]
        i, j = min(int(x), 2 * half - 1), min(int(y), 2 * half - 1)
        u, v = x - i, y - j
        kernel[j : j + 2, i : i + 2] += np.outer((1.0 - v, v), (1.0 - u, u))
    out: NDArray[np.uint8] = cv2.filter2D(
        image, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REPLICATE
    ).astype(np.uint8, copy=False)
    return out


def _later(draw: Callable[..., None], *what: Any) -> Callable[[], None]:
    """Return a call to be made later."""
    return lambda: draw(*what)
