"""Faults of the buses of our kinds, and the shipped rigs that have them."""

from dataclasses import replace
from typing import Any

from fault_machine import LINE, Case, lasting_cases

from gazerig.config.rig import BusConfig
from gazerig.config.schema import Rig, load_rig

PACKETS = [
    *lasting_cases(
        "truncate {i} 5", "truncate all 11", "drop {i} 3", "drop {i} 8", "fragment {i}", "fragment",
        "reorder", "wrong-id {i} {j}", "wrong-id {i} 77", "short {i} 2", "short all 1",
        "long {i} 2", "long all 1", "refuse {i} 7", "refuse {i} 32", "refuse all 7",
        "noise before FFFFFD00", "noise before FFFF0102", "noise after FFFF01",
    ),
    Case(("set after-missing silence", "lose {i}")),
    Case(("set after-missing skip", "lose {i}")),
    Case(("set after-missing timeout", "lose {i}")),
    Case(("brown-out {i}",)),
    Case(("brown-out {i}", "brown-out {j}")),
    Case(("lose {i}", "brown-out {i}")),
    Case(("unplug", "brown-out {i}"), ("plug",)),
    Case(("overload {i}",)),
    Case(("overheat {i}",)),
    Case(("encoder {i}",)),
    Case(("temperature {i} 66",), ("temperature {i} 30",)),
    Case(("voltage {i} 3.0",), ("voltage {i} {volts}",)),
    Case(("voltage all 3.0",), ("voltage all {volts}",)),
    Case(("voltage {i} 16",), ("voltage {i} {volts}",)),
    Case(("stick {i}",), ("free {i}",), own_speed=True),
    Case(("load {i} 0.05",), ("load {i} 0",)),
    Case(("collide {i}",)),
]  # fmt: skip
"""What befalls smart servos beside."""

ERRORS = (
    "signal", "overrun", "buffer-full", "crc", "protocol", "timeout", "script-stack",
    "script-call-stack", "script-counter",
)  # fmt: skip
BOARD = [
    *lasting_cases(*(f"error {name}" for name in ERRORS)),
    *lasting_cases("lose-bytes 1", "lose-bytes 7", "lose-bytes 1000 for 1"),
    Case(("set on-error home", "error protocol")),
    Case(("set on-error ignore", "error protocol")),
    Case(("brown-out",)),
    Case(("set startup home", "brown-out")),
    Case(("lose all", "brown-out")),
    Case(("unplug", "brown-out"), ("plug",)),
    Case(("script on",), ("script off",)),
    Case(("script {i}",), ("script off",), own_speed=True),
    Case(("power off",), ("power on",), own_speed=True),
    Case(("stick {i}",), ("free {i}",), own_speed=True),
]
"""What befalls a Maestro and its servos beside."""

I2C = [
    *lasting_cases(
        "lose-bytes 1", "lose-bytes 7", "lose-bytes 1000 for 1", "nack 1", "nack 40", "nack",
        "nack for 0.5",
    ),
    Case(("stuck on",), ("stuck off",)),
    Case(("absent on",), ("absent off",)),
    Case(("foreign on",), ("foreign off",)),
    Case(("brown-out",)),
    Case(("nack 3", "brown-out")),
    *(Case(("brown-out", f"corrupt {{i}} {bit}")) for bit in (10, 24)),
    Case(("absent on", "brown-out"), ("absent off",)),
    Case(("lose all", "brown-out")),
    Case(("unplug", "brown-out"), ("plug",)),
    Case(("power off",), ("power on",), own_speed=True),
    Case(("stick {i}",), ("free {i}",), own_speed=True),
]  # fmt: skip
"""What befalls a PCA9685 and its servos beside."""

CASES = {
    "dynamixel": [*LINE, *PACKETS, Case(("shock {i}",))],
    "feetech": [*LINE, *PACKETS, Case(("reset {i}",))],
    "maestro": [*LINE, *BOARD],
    "pca9685": [*LINE, *I2C],
}

VOLTS = {"dynamixel": 5.0, "feetech": 7.4, "maestro": 5.0, "pca9685": 5.0}
RIGS = {"dynamixel": "desk", "feetech": "feetech", "maestro": "maker", "pca9685": "maker"}
"""The shipped rig of each kind."""


def rig_of(kind: Any) -> Rig:
    """Return the shipped rig of a kind, with the other board where its own has none."""
    rig = load_rig(RIGS[kind])
    return replace(rig, bus=BusConfig("/dev/i2c-1", kind)) if kind == "pca9685" else rig


FEW = ("left_eye_pan", "left_eye_tilt", "neck_yaw")


def quick(rig: Rig) -> Rig:
    """Return the rig with an eye and a turn of the neck alone."""
    few = {name: joint for name, joint in rig.joints.items() if name in FEW}
    return replace(rig, joints=few if len(few) == len(FEW) else rig.joints)
