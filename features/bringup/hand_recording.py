"""Recording of a head moved by hand, without torque: its joints are read at regular times."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import DriverError, ServoFault, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.features.bringup.telemetry import TelemetrySample
from gazerig.gaze.types import Floats
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointParams

RATE_HZ = 50.0
LONGEST_S = 60.0
_LEAST_SHARE = 0.5
"""Fraction of answered readings that a recorded joint must exceed."""


class HandRecording(NamedTuple):
    """A recording by hand.

    series: times in seconds from the start, and angles in degrees, by joint
    left_out: joints whose servos failed to answer too often
    ended_by: reason of the end
    """

    series: Mapping[str, tuple[Floats, Floats]]
    left_out: tuple[str, ...]
    ended_by: str


def switch_off(joints: Mapping[str, JointParams], port: BusPort) -> None:
    """Switch the torque of all servos of a line off, and verify it.

    All servos are tried, even after a failure.

    Raises:
        ServoFault: the torque of a servo stays on, or it does not answer.
    """
    holding = []
    for name, joint in joints.items():
        family = servo_kind(joint.model).family
        registers = Registers(port, family)
        registers.write(joint.id, "torque_enable", 0)
        if registers.read(joint.id, "torque_enable") != 0:
            holding.append(f"{name} (servo {joint.id})")
    if holding:
        raise ServoFault(
            f"{', '.join(holding)}: not known to have let go: cut the servo power, then find the "
            "cause with gazerig doctor"
        )


def record_hand_motion(
    sample: Callable[[], TelemetrySample],
    clock: Clock,
    stopped: Callable[[], str | None],
    seconds: float = LONGEST_S,
) -> HandRecording:
    """Read the joints until the time is over or a person ends it.

    Args:
        sample: reads every servo once.
        clock: clock of the ports.
        stopped: returns why to end, None before.
        seconds: longest time.

    Raises:
        SetupError: a torque was switched on: another program moves the head.
        DriverError: a port has disappeared, or no servo answered.
    """
    start_s, rows = clock.now_s(), list[TelemetrySample]()
    ended_by, slot = None, 0
    while ended_by is None and clock.now_s() - start_s < seconds:
        row = sample()
        on = [name for name, seen in row.servos.items() if seen is not None and seen.torque]
        if on:
            raise SetupError(f"the torque of {on[0]} came on: another program moves the head")
        rows.append(row)
        ended_by = stopped()
        slot = max(slot + 1, int((clock.now_s() - start_s) * RATE_HZ))
        clock.sleep_until(start_s + slot / RATE_HZ)
    series, left_out = {}, []
    for name in rows[0].servos if rows else ():
        pairs = [
            (row.at_s - start_s, seen.position_deg)
            for row in rows
            if (seen := row.servos[name]) is not None and seen.position_deg is not None
        ]
        if len(pairs) <= _LEAST_SHARE * len(rows):
            left_out.append(name)
        else:
            times, angles = zip(*pairs, strict=True)
            series[name] = np.array(times), np.array(angles)
    if not series:
        raise DriverError("no servo answered: check power, cable, ids and baud rate")
    return HandRecording(series, tuple(left_out), ended_by or "the time is over")
