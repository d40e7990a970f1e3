"""The camera of a run: a simulated scene, a film, a recording, a real one, or a browser's."""

import threading
from collections.abc import Callable
from functools import partial
from math import radians
from operator import itemgetter
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.camera import camera_plugins
from gazerig.drivers.camera.browser_source import FIELD_DEG, BrowserSource
from gazerig.drivers.camera.capture_loop import CameraParts, Motion
from gazerig.drivers.camera.orientation import FrameOrientation
from gazerig.drivers.camera.shared_slots import JpegSlot, PoseBuffer
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import CAMERA, CameraPlugin, find, is_ours, load
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory, fixed_mount
from gazerig.robot.model.kinematics import NECK, Kinematics
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.robot.run.options import RunOptions
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.drivers.camera.file_player import FilePlayer

HeadPose = Callable[[float], tuple[Mat3, Vec3]]
"""Function that returns rotation and position [m] of the head in the world at a time [s]."""
MakeDetector = Callable[[], FaceDetector]

_FILM_DELAY_S = 0.05
"""Age of a film's frames in simulated time."""


class CameraView(NamedTuple):
    """Placement of a run's camera, and the past poses of the head that carries it.

    params: lens and placement; fixed if its frames cannot turn with the head
    turns: history of its rotation, for another process; None if it is fixed
    """

    params: CameraParams
    mount: CameraMount
    poses: PoseHistory
    turns: PoseBuffer | None

    @property
    def field_rad(self) -> float:
        """Return the horizontal field of view."""
        return radians(self.params.horizontal_field_deg)

    @property
    def locate(self) -> FrameLocator:
        """Return the locator of detections in the camera's axes."""
        return FrameLocator(self.params.lens, self.field_rad)

    def motion(self, params: MotionParams) -> Callable[[], Motion]:
        """Return a function that creates the motion detector in the camera's process."""
        return partial(MotionSource, params, self.params.lens, self.field_rad, self.turns)


def place_camera(
    rig: Rig, options: RunOptions, kinematics: Kinematics, in_process: bool
) -> tuple[CameraView, tuple[str, ...]]:
    """Return the placement of a run's camera, and messages about it.

    Args:
        rig: Defines the camera.
        options: Select its source.
        kinematics: Kinematics of the head.
        in_process: Whether frames are analysed, which needs the rotation of the camera.
    """
    what, params, notes = options.camera_source, rig.camera, tuple[str, ...]()
    filmed = options.video is not None
    if what is not None and (filmed or options.mock) and params.mount != "base":
        where = "" if filmed else " next to an emulated head"
        notes = (f"{what}{where} does not turn with the head: the camera counts as fixed",)
        params = fixed_mount(params, kinematics)
    mount = CameraMount(params)
    turns = PoseBuffer() if in_process and mount.on_head else None

    def send(t_s: float, R_world_head: Mat3) -> None:
        if turns is not None:
            turns.record(t_s, mount.rotation(R_world_head))

    return CameraView(params, mount, PoseHistory(kinematics, tell=send), turns), notes


def detector_of(rig: Rig, own: FaceDetector | None) -> MakeDetector:
    """Return a function that creates the detector of a program, otherwise that of the rig."""
    return partial(face_detector, rig.detector) if own is None else lambda: own


def real_camera(
    rig: Rig, view: CameraView, options: RunOptions, now_s: Callable[[], float],
    own: FaceDetector | None = None, camera: Camera | FrameSource | None = None,
) -> Camera:  # fmt: skip
    """Return the camera of a film, a recording, a webcam, an OAK-D, a package or a program.

    The rig's detectors analyse its frames; one that returns detections is used as it is.

    Args:
        rig: Parameters of camera and detectors.
        view: Placement of the camera.
        options: Select the camera.
        now_s: The host's clock.
        own: A program's own detector, which exists only in this process.
        camera: A program's own camera, which exists only in this process.

    Raises:
        SetupError: a film, recording or model file cannot be used, or a program's camera returns
            frames in simulated time.
    """
    source = _source(rig, options) if camera is None else partial(cast, FrameSource, camera)
    is_package = isinstance(options.camera, str) and not is_ours(CAMERA, options.camera)
    if camera is not None or is_package:
        made = source()
        if not camera_plugins.is_source(made):
            return cast(Camera, made)
    detector, motion = detector_of(rig, own), view.motion(rig.motion)
    orientation = FrameOrientation(view.params.rotation, view.params.mirrored)
    if not options.fast:
        parts = CameraParts(
            source, detector, motion, view.locate, orientation, options.record_camera
        )
        return CameraWorker(parts, now_s, in_thread=own is not None or camera is not None)
    if camera is not None:
        raise SetupError(
            f"camera {type(camera).__name__} of the program returns frames in real time: in "
            "simulated time return detections"
        )
    from gazerig.sim_mock.cameras.video import FilmCamera

    film = cast("FilePlayer", source())
    return FilmCamera(film, detector(), _FILM_DELAY_S, 0.0, motion(), view.locate, orientation)


def _source(rig: Rig, options: RunOptions) -> Callable[[], FrameSource]:
    """Return a function that creates the source of frames, in the process that will use it."""
    name = options.camera
    if options.video is not None:
        return partial(camera_plugins.film, options.video)
    if options.oak or name == "oak":
        return partial(camera_plugins.oak, rig.oak)
    if isinstance(name, int) or name == "webcam":
        return partial(camera_plugins.webcam, rig.webcam, name if isinstance(name, int) else 0)
    assert name is not None
    params = rig.plugins.get(name)
    try:
        params = load(CAMERA, name, CameraPlugin).params() if params is None else params
    except TypeError as error:
        label = find(CAMERA, name).label
        raise PluginError(f"{label} needs a section {name} in the rig") from error
    return partial(camera_plugins.create_camera_part, name, params)


# --- simulated scenes


def true_head_pose(steps: Callable[[], dict[str, float]], rig: Rig, head: Kinematics) -> HeadPose:
    """Return the pose of the emulated head, from the true positions of its servos.

    Its mechanics are those of the rig at the start, even if parameters change later.
    """
    pairs = rig.couplings.values()
    linkages = {
        name: rig.joints[name].make_linkage()
        for name in {*NECK, *(joint for pair in pairs for joint in pair.joints)} & rig.joints.keys()
    }
    absent, angles_of = dict.fromkeys(NECK, 0.0), itemgetter(*NECK)

    def now(_: float) -> tuple[Mat3, Vec3]:
        at, angles = steps(), absent.copy()
        for name, linkage in linkages.items():
            angles[name] = linkage.angle_rad(at[name])
        for pair in pairs:
            first, second = pair.joints
            angles[first], angles[second] = pair.joint_rad((angles[first], angles[second]))
        return head.head_pose(angles_of(angles))

    return now


def scene_camera(
    rig: Rig, view: CameraView, options: RunOptions, own: FaceDetector | None, scene: Scene,
    head: HeadPose, rng: np.random.Generator,
) -> Camera:  # fmt: skip
    """Return a camera on a simulated scene: its detections are computed, or its frames drawn.

    Args:
        rig: Parameters of camera and detectors.
        view: Placement of the camera.
        options: Whether frames are drawn.
        own: A program's own detector.
        scene: The scene in front of the camera.
        head: True pose of the head.
        rng: Random numbers of the camera's noise.
    """
    field_deg = rig.camera.horizontal_field_deg
    params, locate = FrameParams(horizontal_field_deg=field_deg), view.locate
    if not options.pixels:
        return SceneCamera(params, scene, view.mount, head, rng, locate)
    from gazerig.sim_mock.cameras.rendered import PixelCamera

    detector, motion = detector_of(rig, own), view.motion(rig.motion)()
    drawn = DrawnScene(scene)
    return PixelCamera(params, drawn, view.mount, head, detector(), rng, motion, locate)


# --- a browser's camera

SILENT_S = 1.5
"""Silence after which a browser counts as gone."""


def browser_worker(rig: Rig, now_s: Callable[[], float], pictures: JpegSlot) -> CameraWorker:
    """Return the process that analyses a browser's images; its scene is not the simulated one."""
    locate = FrameLocator(None, radians(FIELD_DEG))
    motion = partial(MotionSource, rig.motion, None, locate.field_rad, None)
    source = partial(BrowserSource, pictures)
    parts = CameraParts(source, detector_of(rig, None), motion, locate, before=1)
    return CameraWorker(parts, now_s)


class BrowserCamera:
    """A browser's own camera, used instead of an emulated rig's while its images arrive.

    Its process starts with the first image and stays until the end of the run.

    The images arrive through the page's process, and are analysed in a camera process like those
    of a webcam. The head looks at the person in front of the browser; when they end, the simulated
    scene returns.

    Args:
        make: Returns the process that analyses the images of a slot; see ``browser_worker``.
        now_s: The host's clock.
        use: Called in the loop's thread with the camera to use, None for the rig's own.
        report: Called with each event as one line.

    in_use: whether the browser's camera is in use
    """

    def __init__(
        self,
        make: Callable[[JpegSlot], CameraWorker],
        now_s: Callable[[], float],
        use: Callable[[Camera | None], None],
        report: Callable[[str], None],
    ) -> None:
        self.in_use = False
        self._make, self._now_s, self._use, self._report = make, now_s, use, report
        self._pictures = JpegSlot()
        self._worker: CameraWorker | None = None
        self._starting: threading.Thread | None = None
        self._closed = False
        self._fault = ""

    def take(self, jpeg: bytes) -> None:
        """Store an image of a browser; called from one thread other than the loop's."""
        if self._closed or not self._pictures.put(jpeg, self._now_s()):
            return
        if self._starting is None:
            self._starting = threading.Thread(
                target=self._start, name="browser camera", daemon=True
            )
            self._starting.start()

    def _start(self) -> None:
        """Start the process, which takes a second; the scene continues meanwhile."""
        worker = self._make(self._pictures)
        try:
            worker.open()
        except SetupError as error:
            self._fault = f"a browser's camera cannot be used: {error}"
            return
        self._worker = worker
        if self._closed:
            worker.close()

    def update(self) -> bool:
        """Begin or end the use of the camera, and return whether that has changed.

        Called by the loop in each tick.
        """
        worker, now_s = self._worker, self._now_s()
        fault, self._fault = self._fault, ""
        if fault:
            self._report(fault)
        if self.in_use:
            if now_s - self._pictures.came_s > SILENT_S:
                return self._switch(None, "the browser's camera has ended: the scene continues")
            return False
        found = worker.latest(now_s) if worker is not None else None
        if found is None or now_s - found.captured_s > SILENT_S:
            return False
        return self._switch(
            worker,
            "using a browser's camera; its unknown field of view is assumed to be "
            f"{FIELD_DEG:g} deg; the scene pauses",
        )

    def _switch(self, camera: Camera | None, line: str) -> bool:
        self.in_use = camera is not None
        self._use(camera)
        self._report(line)
        return True

    def close(self) -> None:
        """End the process; safe to call twice."""
        self._closed = True
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.close()
