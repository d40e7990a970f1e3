"""Pictures of the rig's camera in a world with physics.

In real time another process computes the world. The camera's process renders its newest state and
detects faces and motion in the picture; the control loop needs neither MuJoCo nor pictures. With
``--no-pictures`` detections are computed instead, like those of a scene.
"""

import threading
from collections.abc import Callable
from math import radians
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gazerig.drivers.camera.capture_loop import Locate, Motion
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, FaceDetector, ImageArray
from gazerig.features.world.gl_context import render_in_calling_thread
from gazerig.features.world.run.poses import SimulatedPoses, WorldPoses
from gazerig.features.world.world_spec import WorldSpec
from gazerig.gaze.types import Mat3
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens
from gazerig.robot.model.scene import PinholeView
from gazerig.robot.run.cameras import HeadPose
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.script import WorldCameraParams

if TYPE_CHECKING:
    from gazerig.robot.model.scene import SceneView
    from gazerig.sim_mock.cameras.rendered import PixelCamera

LATENCY_MS = 60.0
"""Delay from the exposure of a picture to its arrival in simulated time."""
HEAD_LINK = "rig_head"
"""Link of a rig that carries its camera, and is invisible to it."""
_LEVEL: Mat3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class RenderedWorld(NamedTuple):
    """Everything that a process needs to render the pictures of the rig's camera in a world.

    It can be sent to the process.
    """

    spec: WorldSpec
    mount: CameraMount
    camera: CameraParams
    rng: np.random.Generator
    params: WorldCameraParams
    poses: WorldPoses | SimulatedPoses

    def pixels(
        self,
        head: HeadPose,
        detector: FaceDetector,
        latency_ms: float = 0.0,
        find_motion: Motion | None = None,
        locate: Locate | None = None,
    ) -> "PixelCamera":
        """Return the camera after it has rendered one picture; arguments as of ``PixelCamera``.

        Raises:
            NoRenderer: nothing on this machine can render.
        """
        from gazerig.sim_mock.cameras.rendered import PixelCamera

        asked, field_deg = self.params, self.camera.horizontal_field_deg
        params = FrameParams(asked.width_px, asked.height_px, field_deg, asked.rate_hz, latency_ms)
        size_px = asked.width_px, asked.height_px
        lens = intrinsics_of_lens(self.camera.lens, radians(field_deg), *size_px)
        view = self._view()
        camera = PixelCamera(
            params, view, self.mount, head, detector, self.rng, find_motion, locate, lens,
            lambda: self.poses.begin_s,
        )  # fmt: skip
        view.draw(PinholeView(0.0, lens, size_px, _LEVEL, (0.0, 0.0, 0.0)))
        return camera

    def _view(self) -> "SceneView":
        model = self.spec.compile()
        from gazerig.features.world.figure_model import PeoplePlacer
        from gazerig.features.world.renderer import RendererParams, WorldPicture

        people = PeoplePlacer(model.mj, model.figures)

        def place(data: Any, t_s: float) -> None:
            state = self.poses.state
            if state is not None:
                data.qpos[:] = state.qpos
            people.place(data, t_s)

        return WorldPicture(
            model.mj,
            place,
            RendererParams(samples=self.params.samples),
            (HEAD_LINK,),
            model.rig.R_world_base,
            model.rig.p_world_base_m,
        )


class _NoFaces:
    """Detector that finds no faces: the camera's process detects them later."""

    def find(self, bgr: ImageArray) -> tuple[DetectedFace, ...]:
        return ()


_LOOK_S = 0.002


class RenderedSource:
    """Source of a world's frames in real time, rendered from the newest pose of the head.

    The camera's process renders and detects, so that neither can delay a tick.

    Args:
        world: Renders the frames.
        poses: Poses of the head.
    """

    def __init__(self, world: "RenderedWorld", poses: WorldPoses) -> None:
        render_in_calling_thread()
        self._camera, self._poses = world.pixels(poses.head, _NoFaces()), poses
        self._number, self._due_s, self._period_s = 0, 0.0, 1.0 / world.params.rate_hz

    def open(self) -> None:
        """Start with the first frame."""
        self._camera.open()
        self._number = 0

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Draw the next frame, from the newest pose; None if ``stop`` was set."""
        while not stop.is_set():
            state, wait_s = self._poses.newest(), self._due_s - now_s()
            if state is not None and wait_s <= 0.0:
                found = self._camera.latest(state.host_s)
                if found is not None and found.image is not None and found.number > self._number:
                    self._number = found.number
                    self._due_s = max(now_s(), state.host_s + self._period_s)
                    return Shot(found.captured_s, found.number, found.image)
            stop.wait(max(wait_s, _LOOK_S))
        return None

    def events(self) -> tuple[str, ...]:
        """Return no events: a rendered camera has none."""
        return ()

    def close(self) -> None:
        """Do nothing: the renderer ends with the camera's process."""
