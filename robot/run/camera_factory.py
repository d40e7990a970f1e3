"""The camera of a run and its placement: a scene, a film, a recording, a webcam or an OAK-D."""

from collections.abc import Callable
from functools import partial
from math import radians
from operator import itemgetter
from typing import TYPE_CHECKING, cast

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.camera import camera_plugins
from gazerig.drivers.camera.browser_source import FIELD_DEG
from gazerig.drivers.camera.camera_plugins import create_camera_part, is_source
from gazerig.drivers.camera.capture_loop import CameraParts, Locate, Motion
from gazerig.drivers.camera.orientation import FrameOrientation
from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import CAMERA, CameraPlugin, find, is_ours, load
from gazerig.drivers.types import Camera, FaceDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    PoseHistory,
    fixed_mount,
)
from gazerig.robot.model.kinematics import LOWER_NECK, NECK, Kinematics
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.robot.run.browser_camera import BrowserCamera
from gazerig.robot.run.drawn_camera import DrawnSource, HeadPose, scene_pixels
from gazerig.robot.run.gaze_models import rig_kinematics
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.program_parts import NO_PARTS, ProgramParts, part_label, require_method
from gazerig.robot.run.run_bus import CameraPoses, RunBus, TrueSteps
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.drivers.camera.file_player import FilePlayer

_FILM_DELAY_S = 0.05
"""Age of a film's frames in simulated time."""


def camera_poses(kinematics: Kinematics, camera: CameraParams, real: bool) -> CameraPoses:
    """Return the placement of a run's camera.

    Args:
        kinematics: Kinematics of the head.
        camera: Present parameters of the camera.
        real: Whether another process reads the camera and needs its rotation.
    """
    mount = CameraMount(camera)
    turns = PoseBuffer() if real and mount.on_head else None

    def send(t_s: float, R_world_head: Mat3) -> None:
        if turns is not None:
            turns.record(t_s, mount.rotation(R_world_head))

    return CameraPoses(mount, PoseHistory(kinematics, tell=send), turns)


def run_camera(
    rig: Rig,
    options: RunOptions,
    scene: Scene | None,
    sight: CameraPoses,
    run_bus: RunBus,
    rng: np.random.Generator,
    placed: CameraParams,
    clock: Clock,
    own: ProgramParts,
) -> Camera:
    """Return the robot's camera."""
    if scene is None:
        return real_camera(rig, options, clock, placed, sight.turns, own)
    locate = frame_locator(placed)
    where = true_head_pose(run_bus.true_steps, rig, sight.poses)
    return scene_camera(
        rig, options, scene, sight.mount, where, rng, locate, own, clock, sight.turns
    )


def true_head_pose(true_steps: TrueSteps | None, rig: Rig, poses: PoseHistory) -> HeadPose:
    """Return the pose of the emulated head, from the true servos if they are in this process.

    Its mechanics are those of the rig at the start, even if parameters change later.
    """
    if true_steps is None:
        return poses.head_pose
    kinematics = rig_kinematics(rig)
    pairs = rig.couplings.values()
    linkages = {
        name: rig.joints[name].make_linkage()
        for name in {*NECK, *LOWER_NECK, *(joint for pair in pairs for joint in pair.joints)}
        & rig.joints.keys()
    }

    absent = dict.fromkeys((*NECK, *LOWER_NECK), 0.0)
    angles_of = itemgetter(*NECK, *LOWER_NECK)

    def now(_: float) -> tuple[Mat3, Vec3]:
        steps, angles = true_steps(), absent.copy()
        for name, linkage in linkages.items():
            angles[name] = linkage.angle_rad(steps[name])
        for pair in pairs:
            first, second = pair.joints
            angles[first], angles[second] = pair.joint_rad((angles[first], angles[second]))
        yaw, pitch, roll, lower_yaw, lower_pitch = angles_of(angles)
        return kinematics.head_pose((yaw, pitch, roll), (lower_yaw, lower_pitch))

    return now


def scene_camera(
    rig: Rig,
    options: RunOptions,
    scene: Scene,
    mount: CameraMount,
    where: HeadPose,
    rng: np.random.Generator,
    locate: FrameLocator,
    own: ProgramParts = NO_PARTS,
    clock: Clock | None = None,
    turns: PoseBuffer | None = None,
) -> Camera:
    """Return a camera on a simulated scene, which renders frames or returns ideal detections.

    clock, turns: the host's clock, and the history of the camera's rotation, for a scene that is
        drawn in real time, in a separate process
    """
    field_deg = rig.camera.horizontal_field_deg
    if not options.pixels:
        params = FrameParams(horizontal_field_deg=field_deg)
        return SceneCamera(params, scene, mount, where, rng, locate)
    if clock is not None and not options.fast:
        motion = partial(MotionSource, rig.motion, rig.camera.lens, radians(field_deg), turns)
        return drawn_camera(rig, scene, mount, where, rng, clock, own, motion, locate)
    # Imported here because drawing and detection need OpenCV.
    from gazerig.robot.run.drawn_motion import SyntheticMotionDetector
    from gazerig.sim_mock.cameras.rendered import PixelCamera

    drawn = FrameParams(horizontal_field_deg=field_deg)
    faces, moves = own.make_detector(rig.detector), SyntheticMotionDetector(rig.motion)
    return PixelCamera(drawn, DrawnScene(scene), mount, where, faces, rng, moves, locate)


def drawn_camera(
    rig: Rig,
    scene: Scene,
    mount: CameraMount,
    where: HeadPose,
    rng: np.random.Generator,
    clock: Clock,
    own: ProgramParts,
    motion: Callable[[], Motion],
    locate: Locate,
) -> CameraWorker:
    """Return a camera on a drawn scene in real time, which is told the pose of the head.

    For a program's own detector, which exists only in that program, it is a thread.

    Args:
        rig: Defines its field of view.
        scene: Scene in front of it.
        mount: Placement on the head.
        where: Rotation and position of the head in the world at a time.
        rng: Random numbers of the noise.
        clock: The host's clock.
        own: Detector of a program, if any.
        motion: creates the motion detector.
        locate: locates detections in the camera's axes.
    """
    poses = PoseBuffer()

    def tell(now_s: float) -> None:
        poses.record(now_s, *where(now_s))

    make = partial(scene_pixels, scene, mount, rig.camera.horizontal_field_deg, rng)
    source: Callable[[], FrameSource] = partial(DrawnSource, make, poses)
    parts = CameraParts(source, _detector_factory(rig, own), motion, locate)
    return CameraWorker(parts, clock.now_s, tell=tell, in_thread=own.detector is not None)


def _detector_factory(rig: Rig, own: ProgramParts) -> Callable[[], FaceDetector]:
    """Return a function that creates the detector of a program, otherwise that of the rig."""
    if own.detector is not None:
        return partial(own.make_detector, rig.detector)
    return partial(face_detector, rig.detector)


def scene_start_s(camera: Camera) -> float | None:
    """Return the start of the scene of a camera without images, None before or without one."""
    return camera.start_s if isinstance(camera, SceneCamera) else None


def camera_placement(
    rig: Rig, options: RunOptions, kinematics: Kinematics, by_browser: bool = False
) -> tuple[CameraParams, tuple[str, ...]]:
    """Return the rig's camera, with mount base if its frames cannot turn with the head.

    by_browser: whether a browser's camera is in use
    """
    what = options.camera_source
    if by_browser:
        return fixed_mount(rig.camera, kinematics), ()
    turns = options.video is None and options.replay is None and not options.mock
    if what is None or turns or rig.camera.mount == "base":
        return rig.camera, ()
    where = "" if options.video or options.replay else " next to an emulated head"
    note = f"{what}{where} does not turn with the head: the camera counts as fixed"
    return fixed_mount(rig.camera, kinematics), (note,)


def browser_camera(
    rig: Rig,
    clock: Clock,
    use: Callable[[CameraWorker | None], None],
    report: Callable[[str], None],
) -> BrowserCamera:
    """Return a browser's camera, which may replace that of an emulated rig."""
    field_rad = radians(FIELD_DEG)
    detector = partial(face_detector, rig.detector)
    motion = partial(MotionSource, rig.motion, None, field_rad, None)
    locate = FrameLocator(None, field_rad)

    def process(source: Callable[[], FrameSource], before: int) -> CameraWorker:
        parts = CameraParts(source, detector, motion, locate, before=before)
        return CameraWorker(parts, clock.now_s)

    return BrowserCamera(process, clock.now_s, use, report)


def real_camera(
    rig: Rig,
    options: RunOptions,
    clock: Clock,
    placed: CameraParams,
    turns: PoseBuffer | None,
    own: ProgramParts = NO_PARTS,
) -> Camera:
    """Return the camera of a program, a film, a recording, a webcam or an OAK-D.

    placed: its placement, which may be fixed although the rig's moves
    turns: history of the camera's rotation; None if it is fixed
    own: camera and detector of a program

    Raises:
        SetupError: a film, recording or model file cannot be used.
    """
    field_rad = radians(placed.horizontal_field_deg)
    motion = partial(MotionSource, rig.motion, placed.lens, field_rad, turns)
    locate, orientation = frame_locator(placed), frame_orientation(placed)
    detector = _detector_factory(rig, own)
    source: Callable[[], FrameSource]
    record = options.record_camera
    name = options.camera if isinstance(options.camera, str) else None
    if own.camera is not None:
        if not is_source(own.camera):
            require_method(own.camera, "camera", "latest")
            return cast(Camera, own.camera)
        if options.fast:
            raise SetupError(
                f"{part_label('camera', own.camera)} returns frames in real time: in simulated time "
                "return detections"
            )
        source, record = partial(cast, FrameSource, own.camera), None
    elif options.fast:
        from gazerig.sim_mock.cameras.video import FilmCamera

        return FilmCamera(
            cast("FilePlayer", _source_factory(rig, options)()),
            detector(),
            _FILM_DELAY_S,
            0.0,
            motion(),
            locate,
            orientation,
        )
    elif name is None or is_ours(CAMERA, name):
        source = _source_factory(rig, options)
    else:
        source = partial(create_camera_part, name, _package_camera_params(rig, name))
        camera = source()
        if not is_source(camera):
            return cast(Camera, camera)
    parts = CameraParts(source, detector, motion, locate, orientation, record)
    in_thread = own.camera is not None or own.detector is not None
    return CameraWorker(parts, clock.now_s, in_thread=in_thread)


def frame_locator(placed: CameraParams) -> FrameLocator:
    """Return the locator of faces and things in the axes of a camera with this lens."""
    return FrameLocator(placed.lens, radians(placed.horizontal_field_deg))


def frame_orientation(camera: CameraParams) -> FrameOrientation:
    """Return the rotation of the camera's frames to upright."""
    return FrameOrientation(camera.rotation, camera.mirrored)


def _package_camera_params(rig: Rig, name: str) -> object:
    """Return the parameters of a package's camera: the rig's section of its name, or defaults."""
    section = rig.plugins.get(name)
    if section is not None:
        return section
    try:
        return load(CAMERA, name, CameraPlugin).params()
    except TypeError as error:
        raise PluginError(
            f"{find(CAMERA, name).label} needs a section {name} in the rig"
        ) from error


def _source_factory(rig: Rig, options: RunOptions) -> Callable[[], FrameSource]:
    """Return a factory of one of our sources, for the process that will use it."""
    if options.replay is not None:
        return partial(camera_plugins.recording, options.replay)
    if options.video is not None:
        return partial(camera_plugins.film, str(options.video))
    if options.oak or options.camera == "oak":
        return partial(camera_plugins.oak, rig.oak)
    number = options.camera if isinstance(options.camera, int) else 0
    return partial(camera_plugins.webcam, rig.webcam, number)
