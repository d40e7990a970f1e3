"""Telemetry of servos: registers and pulses are read, nothing is written.

Reading restarts a bus watchdog, like every packet. Only pulse widths of a Maestro are read and
never its errors: reading clears them, and the program that moves the servos would miss them.
Opening a bus for motion sets its servos up, which is a write; a monitor only reads.
"""

from collections.abc import Callable, Collection, Mapping
from math import degrees

from msgspec import Struct
from msgspec.structs import replace

from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.maestro.board import MOST_INPUT
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.features.bringup.servo_kinds import ServoKind
from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import JointParams

_LIVE = (
    *("torque_enable", "goal_position", "present_velocity", "present_position"),
    *("present_input_voltage", "present_temperature"),
)
"""Registers that are read from every smart servo; errors and load have other names."""


class Telemetry(Struct, frozen=True, kw_only=True):
    """Present values of one servo; None for values that its kind does not have.

    goal_deg, position_deg, velocity_deg_s: at the joint; steps are those of the servo
    load: fraction of the stall torque, signed, -1..1
    errors: errors of the hardware, by name
    measured: False if the position is estimated from the pulse
    pulse_us: pulse width of a hobby servo, 0 for no pulses
    """

    torque: bool
    errors: tuple[str, ...] = ()
    measured: bool = True
    goal_deg: float | None = None
    goal_steps: int | None = None
    position_deg: float | None = None
    position_steps: int | None = None
    velocity_deg_s: float | None = None
    load: float | None = None
    temperature_c: int | None = None
    voltage_v: float | None = None
    pulse_us: float | None = None


class TelemetrySample(Struct, frozen=True):
    """One reading of all servos.

    t_s, took_s: time since the start of the monitor, and duration of the reading
    servos: telemetry by joint; None if the servo did not answer
    asked, unanswered: queries since the start, and those without an answer
    """

    t_s: float
    took_s: float
    servos: dict[str, Telemetry | None]
    asked: int
    unanswered: int


TelemetryReader = Callable[[JointParams], Telemetry | None]
"""Reads a joint's servo, None if it does not reply; raises BusLost if the port has disappeared."""


def smart_servo_reader(port: BusPort, kind: ServoKind) -> TelemetryReader:
    """Return a reader of smart servos, without retries, because the next reading follows soon.

    port: open at the servos' baud rate; kind: the kind of all servos on it
    """
    line, family = Transactions(port, kind.family), kind.family
    line.tries = 1

    def read(joint: JointParams) -> Telemetry | None:
        names = (*_LIVE, family.error_register, family.effort_register)
        found = line.read_many(joint.id, names)
        values = {name: value for name, value in found.items() if value is not None}
        if len(values) < len(found):
            return None
        position = values["present_position"]
        velocity_steps_s = values["present_velocity"] * family.velocity_unit_steps_s
        return Telemetry(
            torque=values["torque_enable"] == 1,
            errors=family.name_errors(values[family.error_register]),
            goal_deg=degrees(joint.angle_rad(values["goal_position"])),
            goal_steps=values["goal_position"],
            position_deg=degrees(joint.angle_rad(position)),
            position_steps=position,
            velocity_deg_s=degrees(velocity_steps_s * joint.make_linkage().rate_rad(position)),
            load=values[family.effort_register] * family.models[joint.model].load_unit,
            temperature_c=values["present_temperature"],
            voltage_v=values["present_input_voltage"] / 10.0,
        )

    return read


def board_reader(board: Board) -> TelemetryReader:
    """Return a reader of the pulses of a board's channels; nothing else is read."""

    def read(joint: JointParams) -> Telemetry | None:
        found = board.read_pulses((joint.id,))
        if found is None:
            return None
        pulse = found[0]
        if 0 < pulse <= MOST_INPUT:
            return Telemetry(torque=False, errors=("its channel is an input",), measured=False)
        at = degrees(joint.angle_rad(pulse)) if pulse else None
        us = pulse / US_STEPS
        return Telemetry(torque=pulse > 0, measured=False, position_deg=at, pulse_us=us)

    return read


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
        self._readers, self._joints = dict(readers), dict(joints)
        self._now_s, self._start_s = now_s, now_s()
        self._asked = self._unanswered = 0

    def sample(self) -> TelemetrySample:
        """Read every servo once.

        Raises:
            BusLost: a port has disappeared.
        """
        began_s = self._now_s()
        servos = {name: self._readers[one.bus](one) for name, one in self._joints.items()}
        self._asked += len(servos)
        self._unanswered += sum(one is None for one in servos.values())
        for pair in self._pairs:
            servos |= _joint_telemetry(pair, servos[pair.first], servos[pair.second])
        now_s = self._now_s()
        return TelemetrySample(
            now_s - self._start_s, now_s - began_s, servos, self._asked, self._unanswered
        )


def _joint_telemetry(
    pair: CouplingParams, one: Telemetry | None, other: Telemetry | None
) -> dict[str, Telemetry | None]:
    """Return the telemetry of two coupled servos with the angles of their joints.

    If either is missing, the angles of both joints are unknown.
    """
    both: list[dict[str, float | None]] = [{}, {}]
    for key in ("goal_deg", "position_deg", "velocity_deg_s"):
        first, second = getattr(one, key, None), getattr(other, key, None)
        angles: tuple[float | None, float | None] = None, None
        if first is not None and second is not None:
            angles = pair.joint_rad((first, second))
        both[0][key], both[1][key] = angles
    return {
        pair.first: one and replace(one, **both[0]),
        pair.second: other and replace(other, **both[1]),
    }
