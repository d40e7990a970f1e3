"""What the servos of a rig do when they are switched on or left alone, in words for a person."""

from gazerig.config.schema import Rig
from gazerig.robot.app.bus_wiring import bus_names, has_watchdog
from gazerig.robot.bringup.servo_families import KINDS

BOARDS = {"maestro": "a Maestro", "pca9685": "a PCA9685"}
"""Boards of hobby servos by the kind of bus."""


def holding(rig: Rig) -> str:
    """Say what the servos do when the torque has come on."""
    told = [name for name in rig.names if rig.joints[name].facts.measured]
    blind = len(rig.names) - len(told)
    if not blind:
        return f"torque on: {len(told)} servos hold where they are"
    pulses = f"{blind} hobby servos hold where their pulses are (reckoned: they tell nothing)"
    return (
        f"torque on: {len(told)} servos hold where they are, {pulses}"
        if told
        else f"pulses on: {pulses}"
    )


def left_alone(rig: Rig) -> str:
    """Say what the servos do that could not be told to let go."""
    return "; ".join(dict.fromkeys(_left_alone(rig, bus) for bus in bus_names(rig)))


def _left_alone(rig: Rig, bus: str) -> str:
    kind = rig.bus_named(bus).kind
    until = "until the servo power is cut, or the guardian, which tries for 10 s, reaches the port"
    if kind in BOARDS:
        return f"{BOARDS[kind]} goes on with its last pulses {until}"
    title = KINDS[kind].title
    if has_watchdog(rig, bus):
        return f"the {title} servos' own watchdog stops them"
    return f"{title} servos hold their last goal {until}"
