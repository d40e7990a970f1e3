"""What the servos of a rig do when they are switched on or left alone, in words for a person."""

from gazerig.config.schema import Rig
from gazerig.drivers.servo_models import BusKind
from gazerig.robot.app.bus_wiring import bus_names

_LEFT_ALONE: dict[BusKind, str] = {
    "dynamixel": "the Dynamixel servos' own watchdog stops them",
    "feetech": "Feetech servos hold their last goal until the servo power is cut, or "
    "the guardian, which tries for 10 s, reaches the port",
    "pca9685": "a PCA9685 goes on with its last pulses until the servo power is cut, or "
    "the guardian, which tries for 10 s, reaches the bus",
    "maestro": "a Maestro goes on with its last pulses until the servo power is cut, or "
    "the guardian, which tries for 10 s, reaches the port",
}


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
        else (f"pulses on: {pulses}")
    )


def left_alone(rig: Rig) -> str:
    """Say what the servos do that could not be told to let go."""
    kinds = {rig.bus_named(name).kind for name in bus_names(rig)}
    return "; ".join(words for kind, words in _LEFT_ALONE.items() if kind in kinds)
