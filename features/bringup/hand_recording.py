"""Recording of joints at regular times: of a limp head moved by hand, or of a running head."""

from collections.abc import Callable, Collection, Mapping
from math import degrees
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import DriverError, ServoFault, SetupError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.features.bringup.telemetry import TelemetrySample
from gazerig.gaze.types import Floats
from gazerig.robot.loop.head_state import HeadState
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointParams

RATE_HZ = 50.0
LONGEST_S = 60.0
_LEAST_SHARE = 0.5
"""Fraction of answered readings that a recorded joint must exceed."""


Row = tuple[float, Mapping[str, float | None]]
"""Time in s and angles in degrees by joint, None for a servo that did not answer."""


class HandRecording(NamedTuple):
    """Angles of joints over time.

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
        line = Transactions(port, family)
        line.write(joint.id, "torque_enable", 0)
        if line.read(joint.id, "torque_enable") != 0:
            holding.append(f"{name} (servo {joint.id})")
    if holding:
        raise ServoFault(
            f"{', '.join(holding)}: not known to have let go: cut the servo power, then find the "
            "cause with gazerig doctor RIG"
        )


def record_hand_motion(
    sample: Callable[[], TelemetrySample],
    clock: Clock,
    stopped: Callable[[], str | None],
    seconds: float = LONGEST_S,
) -> HandRecording:
    """Read the joints of a limp head until the time is over or a person ends it.

    Args:
        sample: reads every servo once.
        clock: clock of the ports.
        stopped: returns why to end, None before.
        seconds: longest time.

    Raises:
        SetupError: a torque was switched on: another program moves the head.
        DriverError: a port has disappeared, or no servo answered.
    """

    def measure() -> Row:
        row = sample()
        on = [name for name, seen in row.servos.items() if seen is not None and seen.torque]
        if on:
            raise SetupError(f"the torque of {on[0]} came on: another program moves the head")
        angles = {
            name: None if seen is None else seen.position_deg for name, seen in row.servos.items()
        }
        return row.t_s, angles

    return _record(measure, clock, stopped, seconds)


def record_live(
    read: Callable[[], HeadState],
    joints: Collection[str],
    clock: Clock,
    stopped: Callable[[], str | None],
    seconds: float,
) -> HandRecording:
    """Record the commanded angles of a running head; it sends no command.

    The end of the tracks that play at its start, a stop or the loss of the head ends it.

    Args:
        read: returns the newest tick; raises DriverError when the head is lost.
        joints: names of the joints; none: all that no track owns.
        clock: clock of the samples.
        stopped: returns why to end, None before.
        seconds: longest time.
    """
    last = read()
    running = [one for one in last.tracks if not one.end_reason]
    owned = {joint for one in running for joint in one.owns}
    joints = joints or [name for name in last.joints if name not in owned]
    unknown = [name for name in joints if name not in last.joints]
    if unknown:
        raise SetupError(f"no joint {unknown[0]!r}; joints of the head: {', '.join(last.joints)}")
    numbers, reason = {one.number for one in running}, ""

    def measure() -> Row:
        nonlocal last, reason
        try:
            last = read()
        except DriverError as error:
            reason = str(error)
        return last.t_s, {name: degrees(last.joints[name].commanded_rad) for name in joints}

    def over() -> str | None:
        if last.stopped:
            return f"the head was stopped: {last.stopped}"
        ended = [
            f"{one.name}: {one.end_reason}"
            for one in last.tracks
            if one.end_reason and one.number in numbers
        ]
        return stopped() or reason or next(iter(ended), None)

    return _record(measure, clock, over, seconds)


def _record(
    measure: Callable[[], Row], clock: Clock, stopped: Callable[[], str | None], seconds: float
) -> HandRecording:
    """Take rows until the time is over or there is a reason to end."""
    start_s, rows = clock.now_s(), list[Row]()
    ended_by, slot = None, 0
    while ended_by is None and clock.now_s() - start_s < seconds:
        row = measure()
        if not rows or row[0] > rows[-1][0]:
            rows.append(row)
        ended_by = stopped()
        slot = max(slot + 1, int((clock.now_s() - start_s) * RATE_HZ))
        clock.sleep_until(start_s + slot / RATE_HZ)
    series, left_out = {}, []
    for name in rows[0][1]:
        pairs = [(t_s - rows[0][0], row[name]) for t_s, row in rows if row[name] is not None]
        times, angles = np.array(pairs, dtype=np.float64).reshape(-1, 2).T
        if len(times) <= _LEAST_SHARE * len(rows):
            left_out.append(name)
        else:
            series[name] = times, angles
    if not series:
        raise DriverError("no servo answered: check power, cable, ids and baud rate")
    return HandRecording(series, tuple(left_out), ended_by or "the time is over")
