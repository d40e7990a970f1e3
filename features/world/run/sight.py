"""Pictures of the rig's camera in a world with physics.

In real time another process computes the world. The camera's process renders its newest state and
detects faces and motion in the picture; the control loop needs neither MuJoCo nor pictures. If
no library on this machine can render, detections are computed instead, like those of a scene.
"""

from collections.abc import Callable
from functools import partial
from math import radians
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.camera.capture_loop import CameraParts, Locate
from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.types import Camera, Detections, FaceDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.features.world.gl_context import NoRenderer, render_in_calling_thread
from gazerig.features.world.run.poses import SimulatedPoses, WorldPoses
from gazerig.features.world.state_file import HostState
from gazerig.features.world.world_spec import WorldSpec
from gazerig.gaze.types import Mat3
from gazerig.robot.app.drawn_camera import (
    DrawnSource,
    HeadPose,
    NoFaces,
)
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.program_parts import ProgramParts
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens
from gazerig.robot.model.scene_view import PinholeView
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Scene
from gazerig.sim_mock.scenes.script import WorldCameraParams

if TYPE_CHECKING:
    from gazerig.robot.model.scene_view import SceneView
    from gazerig.sim_mock.cameras.rendered import FindMotion, PixelCamera


class WorldCamera:
    """A camera in a world in real time.

    Args:
        process: process that renders and detects; None: nothing is rendered.
        ideal: returns a camera that computes detections of a scene with a start time.
        poses: pose of the head, and start time of the people's script.

    Attributes:
        wrapped_camera: process, or camera that computes detections; None until one is chosen.
    """

    def __init__(
        self,
        process: CameraWorker | None,
        ideal: Callable[[float], SceneCamera],
        poses: WorldPoses,
    ) -> None:
        self._process, self._ideal, self._poses = process, ideal, poses
        self.wrapped_camera: CameraWorker | SceneCamera | None = process
        self._events: list[str] = []

    @property
    def start_s(self) -> float | None:
        """Return when the script of the people began, None before that."""
        return self._poses.begin_s

    def open(self) -> None:
        """Start the process; without a renderer continue without pictures."""
        self.wrapped_camera = self._process
        if self._process is not None:
            try:
                self._process.open()
            except NoRenderer as error:
                self.wrapped_camera = None
                self._events.append(no_pictures_message(error))

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections in the newest frame, None before the first."""
        if self.wrapped_camera is None:
            begin_s = self.start_s
            if begin_s is None:
                return None
            self.wrapped_camera = self._ideal(begin_s)
            self.wrapped_camera.open()
        return self.wrapped_camera.latest(now_s)

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events, self._events = (
            (*self._events, *(self.wrapped_camera.events() if self.wrapped_camera else ())),
            [],
        )
        return events

    def close(self) -> None:
        """End the process; safe to call twice."""
        if self._process is not None:
            self._process.close()


def no_pictures_message(error: NoRenderer) -> str:
    """Return a message to the user if nothing can render."""
    return f"{error}; detections are computed instead, without pictures"


_LATENCY_MS = 60.0
"""Delay from the exposure of a picture to its arrival in simulated time."""
HEAD_LINK = "rig_head"
"""Link of a rig that carries its camera, and is invisible to it."""
_LEVEL: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class RenderedWorld(NamedTuple):
    """Everything that a process needs to render the pictures of the rig's camera in a world.

    It can be sent to the process.
    """

    spec: WorldSpec
    scene: Scene
    mount: CameraMount
    camera: CameraParams
    rng: np.random.Generator
    params: WorldCameraParams

    def pixels(
        self,
        newest: Callable[[], HostState | None],
        head: HeadPose,
        detector: FaceDetector,
        simulated: bool = False,
        find_motion: "FindMotion | None" = None,
        locate: Locate | None = None,
        begins_s: float | None = None,
    ) -> "PixelCamera":
        """Return the camera after it has rendered one picture.

        Args:
            newest: returns the state of the world, None before the first.
            head: returns the pose of the head in that state.
            detector: finds the faces.
            simulated: pictures are late on the run's own clock; else rendering takes real time.
            find_motion: finds motion other than that of faces.
            locate: converts detections to the camera's axes, None for none.
            begins_s: start time of the people's script; None: at the first picture.

        Raises:
            NoRenderer: nothing on this machine can render.
        """
        from gazerig.sim_mock.cameras.rendered import PixelCamera

        asked = self.params
        params = FrameParams(
            width_px=asked.width_px,
            height_px=asked.height_px,
            horizontal_field_deg=self.camera.horizontal_field_deg,
            rate_hz=asked.rate_hz,
            latency_ms=_LATENCY_MS if simulated else 0.0,
        )
        field_rad = radians(self.camera.horizontal_field_deg)
        size_px = asked.width_px, asked.height_px
        lens = intrinsics_of_lens(self.camera.lens, field_rad, *size_px)
        view = world_view(self.spec, newest, asked)
        camera = PixelCamera(
            params, view, self.mount, head, detector, self.rng, find_motion, locate, lens, begins_s,
        )  # fmt: skip
        view.draw(PinholeView(0.0, lens, size_px, _LEVEL, (0.0, 0.0, 0.0)))
        return camera


def served_pixels(world: RenderedWorld, poses: WorldPoses, head: HeadPose) -> "PixelCamera":
    """Return the camera that renders the world of another process in its own process.

    Raises:
        NoRenderer: nothing on this machine can render.
    """
    render_in_calling_thread()
    return world.pixels(lambda: poses.state, head, NoFaces())


def world_view(
    spec: WorldSpec,
    newest: Callable[[], HostState | None],
    params: WorldCameraParams,
) -> "SceneView":
    """Return the renderer's view of a world."""
    model = spec.compile()
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.renderer import RendererParams, WorldPicture

    people = PeoplePlacer(model.mj, spec.figures) if spec.figures is not None else None

    def place(data: Any, t_s: float) -> None:
        state = newest()
        if state is not None:
            data.qpos[:] = state.qpos
        if people is not None:
            people.place(data, t_s)

    return WorldPicture(
        model.mj,
        place,
        RendererParams(samples=params.samples),
        (HEAD_LINK,),
        model.rig.R_world_base,
        model.rig.p_world_base_m,
    )


def world_camera(
    rig: Rig,
    options: RunOptions,
    world: RenderedWorld,
    poses: WorldPoses | SimulatedPoses,
    locate: Locate,
    clock: Clock,
    turns: PoseBuffer | None,
    own: ProgramParts,
    say: Callable[[str], None],
) -> Camera:
    """Return the rig's camera in a world."""
    scene_params = FrameParams(horizontal_field_deg=world.camera.horizontal_field_deg)

    def ideal(begin_s: float) -> SceneCamera:
        return SceneCamera(
            scene_params, world.scene, world.mount, poses.head, world.rng, locate, begin_s
        )

    if isinstance(poses, WorldPoses):
        process = None
        if not options.no_pictures:
            field_rad = radians(world.camera.horizontal_field_deg)
            motion = partial(MotionSource, rig.motion, world.camera.lens, field_rad, turns)
            source: Callable[[], FrameSource] = partial(
                DrawnSource, partial(served_pixels, world, poses), poses
            )
            parts = CameraParts(source, partial(face_detector, rig.detector), motion, locate)
            process = CameraWorker(parts, clock.now_s)
        return WorldCamera(process, ideal, poses)
    if options.no_pictures:
        return ideal(poses.begin_s)
    from gazerig.robot.app.drawn_motion import SyntheticMotionDetector

    try:
        return world.pixels(
            lambda: poses.state, poses.head, own.make_detector(rig.detector), True,
            SyntheticMotionDetector(rig.motion), locate, poses.begin_s,
        )  # fmt: skip
    except NoRenderer as error:
        say(no_pictures_message(error))
        return ideal(poses.begin_s)
