"""The camera of a run: where it sits, and what it looks at."""

from collections.abc import Callable

import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.camera.pose_buffer import PoseBuffer
from gazerig.drivers.types import Camera
from gazerig.gaze.types import Mat3
from gazerig.robot.app.camera_factory import locator_of, real_camera, scene_camera
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.program_parts import ProgramParts
from gazerig.robot.app.run_bus import true_head
from gazerig.robot.app.run_parts import RunBus, Sight
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import CameraMount, CameraParams, NewestPose, PoseHistory
from gazerig.robot.model.kinematics import Kinematics
from gazerig.sim_mock.scenes.scene import Scene


def sight_of(
    kinematics: Kinematics, camera: CameraParams, options: RunOptions, real: bool
) -> Sight:
    """Return where the camera of a run sits.

    Args:
        kinematics: of the head.
        camera: the camera as it is believed.
        options: by which pose detections are placed.
        real: another process looks through it, and must know how it is turned.
    """
    mount = CameraMount(camera)
    turns = PoseBuffer() if real and mount.on_head else None
    history = PoseHistory if options.placed_by == "capture" else NewestPose
    return Sight(mount, history(kinematics, tell=_turn_sender(mount, turns)), turns)


def _turn_sender(
    mount: CameraMount, turns: PoseBuffer | None
) -> Callable[[float, Mat3], None] | None:
    """Return what tells the camera's process how its camera is turned, None if it is not needed."""
    if turns is None:
        return None
    return lambda t_s, R_world_head: turns.record(t_s, mount.rotation(R_world_head))


def run_camera(
    rig: Rig,
    options: RunOptions,
    scene: Scene | None,
    sight: Sight,
    wires: RunBus,
    rng: np.random.Generator,
    placed: CameraParams,
    clock: Clock,
    own: ProgramParts,
) -> Camera:
    """Return what the robot looks through."""
    if scene is None:
        return real_camera(rig, options, clock, placed, sight.turns, own)
    locate = locator_of(placed)
    where = true_head(wires.true_steps, rig, sight.poses)
    return scene_camera(
        rig, options, scene, sight.mount, where, rng, locate, own, clock, sight.turns
    )
