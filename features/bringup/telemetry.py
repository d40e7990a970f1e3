"""What one servo tells of itself: reads alone, nothing is written.

A bus watchdog is fed by it, as by every packet. A Maestro is asked for pulse widths and never
for its errors: reading them clears them, and the program that moves the servos would miss them.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import degrees
from typing import NamedTuple, Protocol

from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.maestro.commands import MOST_INPUT
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.servo_family import ServoKind
from gazerig.robot.model.joint import JointParams

LIVE = (
    "torque_enable",
    "goal_position",
    "present_velocity",
    "present_position",
    "present_input_voltage",
    "present_temperature",
)
"""Registers that every smart servo is asked for; its errors and its load are called differently."""


class Telemetry(NamedTuple):
    """What one servo says of itself now; None where its kind does not tell.

    goal_deg, position_deg, velocity_deg_s: at the joint; the steps are the servo's own
    load: share of the stall torque, signed, -1..1
    errors: of the hardware, by name
    measured: False where the position is estimated: that of the pulse, wherever the servo is
    pulse_us: pulse width that a hobby servo gets, 0 where it gets none
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
            BusLost: the port is gone.
        """
        ...


class SmartServoTelemetry:
    """Reads smart servos; one try is enough, the next reading comes soon.

    Args:
        port: open at the servos' baud rate.
        kind: the kind of all servos on it.
    """

    def __init__(self, port: BusPort, kind: ServoKind) -> None:
        self._registers, self._kind = Registers(port, kind.family, tries=1), kind
        self._names = (*LIVE, kind.family.error_register, kind.family.effort_register)

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's servo; see TelemetryReader."""
        values = self._registers.read_many(joint.id, self._names)
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
        degrees(velocity_steps_s * joint.made().rate_rad(position)),
        effort * family.models[joint.model].load_unit,
        values["present_temperature"],
        values["present_input_voltage"] / 10.0,
        values["torque_enable"] == 1,
        family.name_errors(values[family.error_register]),
    )


class MaestroTelemetry:
    """Reads the channels of a Maestro: which pulse each gives, and nothing else.

    A board that is still to detect its baud rate waits for the first byte of the Pololu
    form; so where it keeps silent the question is put in that form, too.
    """

    def __init__(self, port: BusPort, params: MaestroParams) -> None:
        self._lines = [
            MaestroLink(port, params),
            MaestroLink(port, replace(params, protocol="pololu")),
        ]

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's pulse; see TelemetryReader."""
        found = self._lines[0].pulses((joint.id,))
        if found is None:
            self._lines.reverse()
            return None
        return pulse_telemetry(joint, found[0])


class Pca9685Telemetry:
    """Reads the channels of PCA9685 boards: which pulse each gives, and nothing else."""

    def __init__(self, port: BusPort, params: Pca9685Params) -> None:
        self._board = Pca9685Board(port, params)

    def read(self, joint: JointParams) -> Telemetry | None:
        """Read a joint's pulse; see TelemetryReader."""
        found = self._board.pulses((joint.id,))
        return None if found is None else pulse_telemetry(joint, found[0])


def pulse_telemetry(joint: JointParams, pulse_steps: int) -> Telemetry:
    """Return what the pulse of a joint's channel tells; 0 is none, so nothing holds the servo."""
    if 0 < pulse_steps <= MOST_INPUT:
        return Telemetry(*_UNTOLD, False, ("its channel is an input",), False, None)
    at = degrees(joint.angle_rad(pulse_steps)) if pulse_steps else None
    us = pulse_steps / US_STEPS
    return Telemetry(None, None, at, *_UNTOLD[3:], pulse_steps > 0, (), False, us)


_UNTOLD = (None,) * 8
