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
from gazerig.drivers.camera.camera_plugins import (
    create_camera_part,
    create_plugin_source,
    is_source,
)
from gazerig.drivers.camera.capture_loop import Locate, Motion
from gazerig.drivers.camera.double_buffer import PoseBuffer, PoseSlot
from gazerig.drivers.camera.orientation import FrameOrientation, UprightSource, upright
from gazerig.drivers.camera.process import CameraProcess
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.thread import CameraThread
from gazerig.drivers.camera.worker import CameraParts
from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import CAMERA, CameraPlugin, find, is_ours, load
from gazerig.drivers.types import Camera
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.app.borrowed_camera import BorrowedCamera
from gazerig.robot.app.drawn_camera import DrawnCamera, DrawnSource, HeadPose, scene_pixels
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.program_parts import NO_PARTS, ProgramParts, part_label, require_method
from gazerig.robot.app.run_bus import CameraPoses, RunBus, TrueSteps
from gazerig.robot.app.surroundings import RoomCamera
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    NewestPose,
    PoseHistory,
    fixed_mount,
)
from gazerig.robot.model.kinematics import LOWER_NECK, NECK, Kinematics
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.motion_source import MotionSource
from gazerig.sim_mock.cameras.detections import SceneCamera, SceneCameraParams
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.drivers.camera.file_player import FilePlayer


def camera_poses(
    kinematics: Kinematics, camera: CameraParams, options: RunOptions, real: bool
) -> CameraPoses:
    """Return the placement of a run's camera.

    Args:
        kinematics: Kinematics of the head.
        camera: Present parameters of the camera.
        options: Define the head pose used to locate detections.
        real: Whether another process reads the camera and needs its rotation.
    """
    mount = CameraMount(camera)
    turns = PoseBuffer() if real and mount.on_head else None
    history = PoseHistory if options.placed_by == "capture" else NewestPose

    def send(t_s: float, R_world_head: Mat3) -> None:
        if turns is not None:
            turns.record(t_s, mount.rotation(R_world_head))

    return CameraPoses(mount, history(kinematics, tell=send if turns is not None else None), turns)


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
        params = SceneCameraParams(horizontal_field_deg=field_deg)
        return SceneCamera(params, scene, mount, where, rng, locate)
    if clock is not None and not options.fast:
        motion = partial(MotionSource, rig.motion, rig.camera.lens, radians(field_deg), turns)
        return drawn_camera(rig, scene, mount, where, rng, clock, own, motion, locate)
    # Imported here because drawing and detection need OpenCV.
    from gazerig.robot.app.drawn_motion import SyntheticMotionDetector
    from gazerig.sim_mock.cameras.rendered import PixelCamera, PixelCameraParams

    drawn = PixelCameraParams(horizontal_field_deg=field_deg)
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
) -> DrawnCamera:
    """Return a camera on a drawn scene in real time.

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
    poses = PoseSlot()
    make = partial(scene_pixels, scene, mount, rig.camera.horizontal_field_deg, rng)
    source: Callable[[], FrameSource] = partial(DrawnSource, make, poses)
    if own.detector is not None:
        return DrawnCamera(
            supervise_source(rig, own, source(), clock, motion, locate), poses, where
        )
    parts = CameraParts(source, partial(face_detector, rig.detector), motion, locate)
    return DrawnCamera(CameraProcess(parts, clock.now_s), poses, where)


def scene_start_s(camera: Camera) -> float | None:
    """Return the start of the scene of a camera without images, None before or without one."""
    if isinstance(camera, BorrowedCamera):
        return None if camera.lent else scene_start_s(camera.own)
    return camera.start_s if isinstance(camera, SceneCamera | RoomCamera) else None


def camera_placement(
    rig: Rig, options: RunOptions, kinematics: Kinematics, seen: Camera | None = None
) -> tuple[CameraParams, tuple[str, ...]]:
    """Return the rig's camera, with mount base if its frames cannot turn with the head.

    seen: the present camera, which may be a browser's
    """
    what = options.camera_source
    if isinstance(seen, BorrowedCamera) and seen.lent:
        return fixed_mount(rig.camera, kinematics), ()
    turns = options.video is None and options.replay is None and not options.mock
    if what is None or turns or rig.camera.mount == "base":
        return rig.camera, ()
    where = "" if options.video or options.replay else " next to an emulated head"
    note = f"{what}{where} does not turn with the head: the camera counts as fixed"
    return fixed_mount(rig.camera, kinematics), (note,)


def make_borrowed_camera(
    own: Camera, rig: Rig, clock: Clock, place: Callable[[], None]
) -> BorrowedCamera:
    """Return an emulated rig's camera, which a browser's may replace."""
    field_rad = radians(FIELD_DEG)
    detector = partial(face_detector, rig.detector)
    motion = partial(MotionSource, rig.motion, None, field_rad, None)
    locate = FrameLocator(None, field_rad)

    def process(source: Callable[[], FrameSource], before: int) -> CameraProcess:
        parts = CameraParts(source, detector, motion, locate)
        return CameraProcess(parts, clock.now_s, before=before)

    return BorrowedCamera(own, process, clock.now_s, place)


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
    detector = partial(face_detector, rig.detector)
    field_rad = radians(placed.horizontal_field_deg)
    motion = partial(MotionSource, rig.motion, placed.lens, field_rad, turns)
    locate = frame_locator(placed)
    if own.camera is not None:
        return program_camera(rig, own, clock, motion, locate, options.fast)
    if options.fast:
        from gazerig.sim_mock.cameras.video import FilmCamera

        film, delay_s = _film_source(options), options.film_delay_s
        faces, turned = own.make_detector(rig.detector), frame_orientation(placed)
        return FilmCamera(film, faces, delay_s, motion=motion(), locate=locate, orientation=turned)
    name = options.camera if isinstance(options.camera, str) else None
    if own.detector is not None and (name is None or is_ours(CAMERA, name)):
        return supervise_source(rig, own, _source_factory(rig, options)(), clock, motion, locate)
    if name is None or is_ours(CAMERA, name):
        parts = CameraParts(_source_factory(rig, options), detector, motion, locate)
        return CameraProcess(parts, clock.now_s)
    params = _package_camera_params(rig, name)
    camera = create_camera_part(name, params)
    if is_source(camera):
        source = upright(partial(create_plugin_source, name, params), frame_orientation(placed))
        parts = CameraParts(source, detector, motion, locate)
        return CameraProcess(parts, clock.now_s)
    return cast(Camera, camera)


def program_camera(
    rig: Rig,
    parts: ProgramParts,
    clock: Clock,
    motion: Callable[[], Motion | None],
    locate: Locate,
    fast: bool,
) -> Camera:
    """Return the program's own camera.

    Raises:
        SetupError: it is not a camera, or it returns frames in simulated time.
    """
    camera = parts.camera
    label = part_label("camera", camera)
    if not is_source(camera):
        require_method(camera, "camera", "latest")
        return cast(Camera, camera)
    if fast:
        raise SetupError(
            f"{label} returns frames in real time: in simulated time return detections"
        )
    turned = UprightSource(cast(FrameSource, camera), frame_orientation(rig.camera))
    return supervise_source(rig, parts, turned, clock, motion, locate)


def supervise_source(
    rig: Rig,
    parts: ProgramParts,
    source: FrameSource,
    clock: Clock,
    motion: Callable[[], Motion | None],
    locate: Locate,
) -> CameraThread:
    """Return a source of frames with the detector in a thread of this program."""
    detector = parts.make_detector(rig.detector)
    return CameraThread(source, detector, clock.now_s, motion=motion(), locate=locate)


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


def _film_source(options: RunOptions) -> "FilePlayer":
    if options.replay is not None:
        from gazerig.drivers.camera.playback import CameraReplay

        return CameraReplay(options.replay)
    from gazerig.drivers.camera.film import Film

    return Film(str(options.video))


def _source_factory(rig: Rig, options: RunOptions) -> Callable[[], FrameSource]:
    """Return a factory of the source of upright frames, for the process that will use it."""
    source: Callable[[], FrameSource]
    if options.replay is not None:
        source = partial(camera_plugins.recording, options.replay)
    elif options.video is not None:
        source = partial(camera_plugins.film, str(options.video))
    elif options.oak or options.camera == "oak":
        source = partial(camera_plugins.oak, rig.oak)
    else:
        number = options.camera if isinstance(options.camera, int) else 0
        source = partial(camera_plugins.webcam, number, rig.webcam)
    if options.record_camera is not None:
        source = partial(camera_plugins.recorded, source, options.record_camera)
    return upright(source, frame_orientation(rig.camera))
