"""Monitoring servos: reads alone, nothing is written, torque stays as it is.

A bus that is opened for moving sets its servos up, which is a write; this one only asks.
"""

from collections.abc import Callable, Mapping, Sequence
from math import degrees, radians
from typing import NamedTuple

from gazerig.features.bringup.telemetry import Telemetry, TelemetryReader
from gazerig.robot.model.coupling import joint_rates
from gazerig.robot.model.coupling_params import CoupledPair
from gazerig.robot.model.joint import JointParams

_DIGITS = {"goal_deg": 2, "position_deg": 2, "velocity_deg_s": 1, "load": 3}


class TelemetrySample(NamedTuple):
    """One reading of all servos.

    at_s, took_s: when it was done and how long it took
    servos: by joint; None where the servo did not answer
    asked, unanswered: servos asked since the start, and how many of those did not answer
    """

    at_s: float
    took_s: float
    servos: Mapping[str, Telemetry | None]
    asked: int
    unanswered: int


class Monitor:
    """Reads the servos of a rig, one after the other.

    Args:
        readers: of the servos of each bus, by the name of the bus.
        joints: in the order of the samples.
        now_s: the ports' clock.
        pairs: joints that two servos move together.
    """

    def __init__(
        self,
        readers: Mapping[str, TelemetryReader],
        joints: Mapping[str, JointParams],
        now_s: Callable[[], float],
        pairs: Sequence[CoupledPair] = (),
    ) -> None:
        self._pairs = tuple(pairs)
        self._readers = dict(readers)
        self._joints = dict(joints)
        self._now_s = now_s
        self._asked = self._unanswered = 0

    def sample(self) -> TelemetrySample:
        """Read every servo once.

        Raises:
            BusLost: a port is gone.
        """
        start_s = self._now_s()
        servos = {name: self._readers[one.bus].read(one) for name, one in self._joints.items()}
        self._asked += len(servos)
        self._unanswered += sum(one is None for one in servos.values())
        for pair in self._pairs:
            one, other = coupled_angles(pair, servos[pair.first], servos[pair.second])
            servos[pair.first], servos[pair.second] = one, other
        end_s = self._now_s()
        return TelemetrySample(end_s, end_s - start_s, servos, self._asked, self._unanswered)


def coupled_angles(
    pair: CoupledPair, one: Telemetry | None, other: Telemetry | None
) -> tuple[Telemetry | None, Telemetry | None]:
    """Return what two coupled servos say with the angles of their joints.

    Without either of them both joints' angles are unknown.
    """
    goals = _joint_deg(pair, one and one.goal_deg, other and other.goal_deg)
    at = _joint_deg(pair, one and one.position_deg, other and other.position_deg)
    speeds: tuple[float | None, float | None] = (None, None)
    if one and other and None not in (*at, one.velocity_deg_s, other.velocity_deg_s):
        turning = one.velocity_deg_s or 0.0, other.velocity_deg_s or 0.0
        slopes = pair.coupling.rates((radians(at[0] or 0.0), radians(at[1] or 0.0)))
        speeds = joint_rates(slopes, turning)
    return (
        one and one._replace(goal_deg=goals[0], position_deg=at[0], velocity_deg_s=speeds[0]),
        other and other._replace(goal_deg=goals[1], position_deg=at[1], velocity_deg_s=speeds[1]),
    )


def _joint_deg(
    pair: CoupledPair, one: float | None, other: float | None
) -> tuple[float | None, float | None]:
    if one is None or other is None:
        return None, None
    first, second = pair.coupling.joint_rad((radians(one), radians(other)))
    return degrees(first), degrees(second)


def as_json(sample: TelemetrySample, start_s: float) -> dict[str, object]:
    """Return a sample as plain values, times in seconds since the start."""
    return {
        "t_s": round(sample.at_s - start_s, 3),
        "took_ms": round(1e3 * sample.took_s, 1),
        "asked": sample.asked,
        "unanswered": sample.unanswered,
        "joints": {
            name: None if seen is None else _plain(seen) for name, seen in sample.servos.items()
        },
    }


def _plain(seen: Telemetry) -> dict[str, object]:
    values = seen._asdict()
    for key, digits in _DIGITS.items():
        if values[key] is not None:
            values[key] = round(values[key], digits)
    if seen.measured:
        del values["pulse_us"]  # smart servos know no such thing
    return values
