"""Everything one tick knew and decided."""

from typing import NamedTuple

from gazerig.drivers.types import Detections
from gazerig.gaze.types import GazeCommand, GazeState, Percept, Target
from gazerig.robot.model.commands import Order
from gazerig.robot.model.types import JointAngles, JointState, Verdict


class Tick(NamedTuple):
    """Everything one tick knew and decided; wish, permitted and measured side by side.

    events: what has happened on the bus and to the camera, in words
    orders: what people asked for, obeyed at the beginning of this tick
    stopped: why somebody stopped the robot, "" while it moves
    led: who leads gaze or joints and with what, "" while nobody does
    """

    t_s: float
    joints: JointState
    pose: GazeState
    detections: Detections | None
    percept: Percept | None
    target: Target
    gaze: GazeCommand
    wish_rad: JointAngles
    verdict: Verdict
    events: tuple[str, ...] = ()
    orders: tuple[Order, ...] = ()
    stopped: str = ""
    led: str = ""


def at_rest(joints: JointState, wish_rad: JointAngles, why: str, names: tuple[str, ...]) -> Verdict:
    """Say that nothing is sent, as somebody stopped the robot."""
    reason = f"all: stopped ({why})"
    each = ("stopped",) * len(names)
    return Verdict(joints.position_rad, "limp", (reason,), wish_rad, each, (reason,), names)
