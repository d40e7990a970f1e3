"""Telemetry of servos: registers and pulses are read, nothing is written.

Reading restarts a bus watchdog, like every packet. Only pulse widths of a Maestro are read and
never its errors: reading clears them, and the program that moves the servos would miss them.
Opening a bus for motion sets its servos up, which is a write; a monitor only reads.
"""

from collections.abc import Callable, Collection, Mapping
from math import degrees
from typing import NamedTuple, Protocol

from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.maestro.board import MOST_INPUT, MaestroBoard, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.features.bringup.servo_kinds import ServoKind
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import JointParams

LIVE = (
    "torque_enable",
    "goal_position",
    "present_velocity",
    "present_position",
    "present_input_voltage",
    "present_temperature",
)
"""Registers that are read from every smart servo; errors and load have other names."""


class Telemetry(NamedTuple):
    """Present values of one servo; None for values that its kind does not have.

    goal_deg, position_deg, velocity_deg_s: at the joint; steps are those of the servo
    load: fraction of the stall torque, signed, -1..1
    errors: errors of the hardware, by name
    measured: False if the position is estimated from the pulse
    pulse_us: pulse width of a hobby servo, 0 for no pulses
    """

    goal_deg: float | None
    goal_steps: int | None
    position_deg: float | None
    position_steps: int | None
    velocity_deg_s: float | None
    load: float | None
    temperature_c: int | None
    voltage_v: float | None
    torque: bool
    errors: tuple[str, ...]
    measured: bool = True
    pulse_us: float | None = None


class TelemetryReader(Protocol):
    """Reads the servos of one line, and writes nothing."""

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's servo; None if it does not reply.

        Raises:
            BusLost: the port has disappeared.
        """
        ...


class SmartServoTelemetry:
    """Reads smart servos without retries, because the next reading follows soon.

    Args:
        port: open at the servos' baud rate.
        kind: the kind of all servos on it.
    """

    def __init__(self, port: BusPort, kind: ServoKind) -> None:
        self._line, self._kind = Transactions(port, kind.family), kind
        self._line.tries = 1
        self._names = (*LIVE, kind.family.error_register, kind.family.effort_register)

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's servo; see TelemetryReader."""
        values = self._line.read_many(joint.id, self._names)
        whole = {name: value for name, value in values.items() if value is not None}
        return telemetry_of(self._kind, joint, whole) if len(whole) == len(values) else None


def telemetry_of(kind: ServoKind, joint: JointParams, values: Mapping[str, int]) -> Telemetry:
    """Return a servo's registers, by name, in units of its joint."""
    family, effort = kind.family, values[kind.family.effort_register]
    goal, position = values["goal_position"], values["present_position"]
    velocity_steps_s = values["present_velocity"] * family.velocity_unit_steps_s
    return Telemetry(
        degrees(joint.angle_rad(goal)),
        goal,
        degrees(joint.angle_rad(position)),
        position,
        degrees(velocity_steps_s * joint.make_linkage().rate_rad(position)),
        effort * family.models[joint.model].load_unit,
        values["present_temperature"],
        values["present_input_voltage"] / 10.0,
        values["torque_enable"] == 1,
        family.name_errors(values[family.error_register]),
    )


class MaestroTelemetry:
    """Reads only the pulses of the channels of a Maestro."""

    def __init__(self, port: BusPort, params: MaestroParams) -> None:
        self._board = MaestroBoard(port, params)

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's pulse; see TelemetryReader."""
        found = self._board.read_pulses((joint.id,))
        return None if found is None else pulse_telemetry(joint, found[0])


class Pca9685Telemetry:
    """Reads only the pulses of the channels of PCA9685 boards."""

    def __init__(self, port: BusPort, params: Pca9685Params) -> None:
        self._board = Pca9685Board(port, params)

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's pulse; see TelemetryReader."""
        found = self._board.read_pulses((joint.id,))
        return None if found is None else pulse_telemetry(joint, found[0])


def pulse_telemetry(joint: JointParams, pulse_steps: int) -> Telemetry:
    """Return the telemetry of a joint's pulse; 0 is no pulse: the servo does not hold."""
    if 0 < pulse_steps <= MOST_INPUT:
        return Telemetry(*_UNTOLD, False, ("its channel is an input",), False, None)
    at = degrees(joint.angle_rad(pulse_steps)) if pulse_steps else None
    us = pulse_steps / US_STEPS
    return Telemetry(None, None, at, *_UNTOLD[3:], pulse_steps > 0, (), False, us)


_UNTOLD = (None,) * 8


_DIGITS = {"goal_deg": 2, "position_deg": 2, "velocity_deg_s": 1, "load": 3}


class TelemetrySample(NamedTuple):
    """One reading of all servos.

    at_s, took_s: time and duration of the reading
    servos: telemetry by joint; None if the servo did not answer
    request_count, unanswered: queries since the start, and those without an answer
    """

    at_s: float
    took_s: float
    servos: Mapping[str, Telemetry | None]
    request_count: int
    unanswered: int


class Monitor:
    """Reads the servos of a rig, one after the other.

    Args:
        readers: readers of the servos of each bus, by the name of the bus.
        joints: joints in the order of the samples.
        now_s: clock of the ports.
        pairs: joints that two servos move together.
    """

    def __init__(
        self,
        readers: Mapping[str, TelemetryReader],
        joints: Mapping[str, JointParams],
        now_s: Callable[[], float],
        pairs: Collection[CouplingParams] = (),
    ) -> None:
        self._pairs = tuple(pairs)
        self._readers = dict(readers)
        self._joints = dict(joints)
        self._now_s = now_s
        self._asked = self._unanswered = 0

    def sample(self) -> TelemetrySample:
        """Read every servo once.

        Raises:
            BusLost: a port has disappeared.
        """
        start_s = self._now_s()
        servos = {name: self._readers[one.bus].read(one) for name, one in self._joints.items()}
        self._asked += len(servos)
        self._unanswered += sum(one is None for one in servos.values())
        for pair in self._pairs:
            one, other = joint_telemetry(pair, servos[pair.first], servos[pair.second])
            servos[pair.first], servos[pair.second] = one, other
        end_s = self._now_s()
        return TelemetrySample(end_s, end_s - start_s, servos, self._asked, self._unanswered)


def joint_telemetry(
    pair: CouplingParams, one: Telemetry | None, other: Telemetry | None
) -> tuple[Telemetry | None, Telemetry | None]:
    """Return the telemetry of two coupled servos with the angles of their joints.

    If either is missing, the angles of both joints are unknown.
    """
    goals = _joint_deg(pair, one and one.goal_deg, other and other.goal_deg)
    at = _joint_deg(pair, one and one.position_deg, other and other.position_deg)
    speeds = _joint_deg(pair, one and one.velocity_deg_s, other and other.velocity_deg_s)
    return (
        one and one._replace(goal_deg=goals[0], position_deg=at[0], velocity_deg_s=speeds[0]),
        other and other._replace(goal_deg=goals[1], position_deg=at[1], velocity_deg_s=speeds[1]),
    )


def _joint_deg(
    pair: CouplingParams, one: float | None, other: float | None
) -> tuple[float | None, float | None]:
    if one is None or other is None:
        return None, None
    return pair.joint_rad((one, other))


def as_json(sample: TelemetrySample, start_s: float) -> dict[str, object]:
    """Return a sample as plain values, times in seconds since the start."""
    joints: dict[str, dict[str, object] | None] = {}
    for name, seen in sample.servos.items():
        joints[name] = values = None if seen is None else seen._asdict()
        if seen is None or values is None:
            continue
        for key, digits in _DIGITS.items():
            if values[key] is not None:
                values[key] = round(values[key], digits)
        if seen.measured:
            del values["pulse_us"]  # smart servos have no pulses
    return {
        "t_s": round(sample.at_s - start_s, 3),
        "took_ms": round(1e3 * sample.took_s, 1),
        "asked": sample.request_count,
        "unanswered": sample.unanswered,
        "joints": joints,
    }
