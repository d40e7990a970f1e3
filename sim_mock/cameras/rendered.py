"""A camera that renders the emulated head's view and runs the real detectors on it.

gazerig.sim_mock.cameras.detections simulates a detector's output; here the real detectors work on
pixels: a room with texture, people with faces and arms, things, distances. Frames arrive after a
latency, at the camera's rate, with noise, and blurred by the camera's turn during the exposure; a
depth frame has the noise of stereo and holes at edges. The effects of a lens and of a sensor that
is read row by row are off by default. A world with physics is drawn by another view.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.capture_loop import Locate
from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.types import Detections, FaceDetector, ImageArray, MovingBlob
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.params import Bounds
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.model.scene_view import PinholeView, Rendered, SceneView
from gazerig.sim_mock.cameras.canvas import Canvas
from gazerig.sim_mock.cameras.draw_person import draw_person, draw_person_arm, draw_room, draw_thing
from gazerig.sim_mock.cameras.optics import (
    CameraMotion,
    OpticsParams,
    Sensor,
    SensorParams,
    expose,
)
from gazerig.sim_mock.scenes.scene import Scene, Thing

_HAND_RADIUS_M = 0.07
_FIRST_THING_ID = 1000  # hands have the numbers of their people, from 0
_BEHIND_HAND_M = 1e-3  # an arm is drawn just before its hand


class Exposure(NamedTuple):
    """One exposed frame and the true pose of its camera.

    image: (h, w, 3) BGR; depth_m: (h, w) metres along the axis, NaN in holes, None without depth
    R_world_camera, p_world_camera_m: true pose of the camera
    """

    captured_s: float
    number: int
    image: ImageArray
    depth_m: NDArray[np.float32] | None
    R_world_camera: Mat3
    p_world_camera_m: Vec3


FindMotion = Callable[[Exposure, Intrinsics], tuple[MovingBlob, ...]]
"""Finds motion since the previous exposure."""


@dataclass(frozen=True)
class PixelCameraParams(SensorParams, OpticsParams):
    """Quality of the camera."""

    width_px: Annotated[int, Bounds(32, 4096)] = 640
    height_px: Annotated[int, Bounds(32, 4096)] = 400
    horizontal_field_deg: Annotated[float, Bounds(10, 150)] = 69.0
    rate_hz: Annotated[float, Bounds(1, 240)] = 30.0
    latency_ms: Annotated[float, Bounds(0, 1000)] = 60.0
    depth: Annotated[bool, "whether distances are measured too"] = False
    room_seed: Annotated[int, Bounds(0, 1 << 30)] = 0


class PixelCamera:
    """A gazerig.drivers.types.Camera in a drawn scene; frames are computed on demand.

    Args:
        params: resolution, rate and noise of the camera.
        scene: the scene in front of it.
        mount: pose of the camera on the head.
        head_pose: true rotation (3, 3) and position [m] of the head in the world at a time [s].
        detector: finds the faces.
        rng: random numbers of the noise.
        find_motion: finds motion, in addition to the faces.
        locate: converts detections from pixels to the camera's axes; None: no conversion.
        view: draws the scene; None: flat people and things in a room.
        lens: lens of the camera, for frames of its size; None: by its field of view.
        begins_s: start of the scene; None: at the first call of ``latest``.
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
        view: SceneView | None = None,
        lens: Intrinsics | None = None,
        begins_s: float | None = None,
    ) -> None:
        self._begins_s = begins_s
        self._params = params
        self._scene = scene
        self._mount = mount
        self._head_pose = head_pose
        self._detector = detector
        self._find_motion = find_motion
        self._locate = locate
        self._view = view or DrawnScene(scene, params.room_seed)
        self.lens = lens or intrinsics_of_view(
            radians(params.horizontal_field_deg), params.width_px, params.height_px
        )
        self._sensor = Sensor(params, rng)
        self.open()

    def open(self) -> None:
        """Start; the first frame is taken at the first call of ``latest``."""
        self._on_the_way: deque[Detections] = deque()
        self._arrived: Detections | None = None
        self._start_s = self._begins_s
        self._number = 0
        self._before: tuple[float, Mat3, Vec3] | None = None

    @property
    def rate_hz(self) -> float:
        """Return the frames per second."""
        return self._params.rate_hz

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived by ``now_s``."""
        if self._start_s is None:
            self._start_s = now_s
        R, p = self._mount.pose(*self._head_pose(now_s))
        if now_s >= self._start_s + self._number / self._params.rate_hz - 1e-9:
            # A late call skips the frames that it missed, as a real camera's buffer does.
            due = int((now_s - self._start_s) * self._params.rate_hz + 1e-6)
            self._number = max(self._number, due) + 1
            par = self._params
            size = par.width_px, par.height_px
            motion = CameraMotion(R, p, R, p, 0.0)
            if self._before is not None and now_s > self._before[0]:
                motion = CameraMotion(R, p, *self._before[1:], now_s - self._before[0])
            since_s = now_s - self._start_s
            seen = expose(self._view, par, since_s, self.lens, size, motion, depth=par.depth)
            image = self._sensor.image(seen.image)
            image.setflags(write=False)  # like the frames of real cameras
            depth = None if seen.depth_m is None else self._sensor.stereo(seen.depth_m)
            shot = Exposure(now_s, self._number, image, depth, R, p)
            blobs = self._find_motion(shot, self.lens) if self._find_motion is not None else ()
            faces = self._detector.find(image)
            found = Detections(
                now_s, self._number, image.shape[1], image.shape[0], faces, blobs, image=image,
                depth_m=depth,
            )  # fmt: skip
            self._on_the_way.append(found.locate_in_camera(self._locate))
        self._before = now_s, R, p
        late_s = self._params.latency_ms / 1e3
        while self._on_the_way and now_s >= self._on_the_way[0].captured_s + late_s - 1e-9:
            self._arrived = self._on_the_way.popleft()
        return self._arrived

    def events(self) -> tuple[str, ...]:
        """Return the detector's events since the last call; the camera itself has none."""
        events = getattr(self._detector, "events", None)
        return events() if events is not None else ()

    def close(self) -> None:
        """Stop, and free the view."""
        self._view.close()


class DrawnScene(NamedTuple):
    """Draws a scene from flat people and things in a room."""

    scene: Scene
    room_seed: int = 0

    def draw(
        self, seen_by: PinholeView, *, depth: bool = False, rows: tuple[int, int] | None = None
    ) -> Rendered:
        """Return a picture; see ``SceneView.draw``."""
        canvas = Canvas(seen_by, depth)
        draw_scene(canvas, self.scene, seen_by.t_s, self.room_seed)
        wanted = slice(*(rows or (None,)))
        return Rendered(canvas.image[wanted], canvas.depth_m[wanted] if depth else None)

    def close(self) -> None:
        """Do nothing: there is nothing to free."""


def draw_scene(canvas: Canvas, scene: Scene, scene_s: float, room_seed: int = 0) -> None:
    """Draw a room with people and things, the farthest first."""
    draw_room(canvas, room_seed)
    eye = (float(canvas.p_m[0]), float(canvas.p_m[1]), float(canvas.p_m[2]))
    drawn: list[tuple[float, Callable[[], None]]] = []
    people = scene.people(scene_s)
    things = [thing._replace(id=_FIRST_THING_ID + thing.id) for thing in scene.things(scene_s)]
    for number, person in enumerate(people):
        away = norm(sub(person.p_world_face_m, eye))
        drawn.append((away, _defer(draw_person, canvas, person, number)))
        if person.hand is not None:
            things.append(Thing(number, "hand", person.hand, _HAND_RADIUS_M, person=number))
    for thing in things:
        away = norm(sub(thing.p_world_m, eye))
        if thing.person is not None:
            draw = _defer(
                draw_person_arm, canvas, people[thing.person], thing.person, thing.p_world_m
            )
            drawn.append((away + _BEHIND_HAND_M, draw))
        drawn.append((away, _defer(draw_thing, canvas, thing)))
    for _, draw in sorted(drawn, key=lambda item: -item[0]):
        draw()


def _defer(draw: Callable[..., None], *what: Any) -> Callable[[], None]:
    """Return a deferred call."""
    return lambda: draw(*what)
