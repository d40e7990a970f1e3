"""Looking at one servo without touching it, kind by kind: reads alone, nothing is written.

A Dynamixel servo's bus watchdog is fed by it, as by every packet. A Maestro is asked for
pulse widths and never for its errors: telling them clears them, and whoever moves the
servos would miss them.
"""

import struct
from dataclasses import replace
from math import degrees
from typing import NamedTuple, Protocol

from gazerig.drivers.dynamixel.control_table import REGISTERS, VELOCITY_UNIT_STEPS_S
from gazerig.drivers.dynamixel.control_table import name_errors as name_dynamixel
from gazerig.drivers.dynamixel.protocol import ALERT
from gazerig.drivers.feetech.memory_table import LOAD_UNIT
from gazerig.drivers.feetech.memory_table import REGISTERS as STS
from gazerig.drivers.feetech.memory_table import name_errors as name_feetech
from gazerig.drivers.feetech.views import ARMED
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.maestro.commands import MOST_INPUT
from gazerig.drivers.maestro.line import Line
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.robot.bringup.servo_families import DYNAMIXEL
from gazerig.robot.model.joint import JointParams

# 116 goal position | 120 tick, 122 moving, 123 status, 124 pwm | 126 current, 128 velocity,
# 132 position | 136, 140 trajectory | 144 voltage, 146 temperature: no gap between them
_LIVE = struct.Struct("<i6xhii8xHB")
_LIVE_AT = REGISTERS["goal_position"].address


class Look(NamedTuple):
    """What one servo says of itself now; None is what its kind does not tell.

    goal_deg, position_deg, velocity_deg_s: at the joint; the steps are the servo's own
    load: share of the stall torque, signed, -1..1
    errors: of the hardware, by name
    measured: False where the position is reckoned: that of the pulse, wherever the servo is
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


class Looks(Protocol):
    """Looks at the servos of one line."""

    def look(self, joint: JointParams) -> Look | None:
        """Ask a joint's servo; None where it does not answer.

        Raises:
            BusLost: the port is gone.
        """
        ...


class DynamixelLooks:
    """Looks at Dynamixel servos; one try is enough, the next look comes soon."""

    def __init__(self, registers: Registers) -> None:
        self._registers = registers

    def look(self, joint: JointParams) -> Look | None:
        """Ask a joint's servo; see Looks."""
        registers, servo_id = self._registers, joint.id
        live = registers.read_bytes(servo_id, _LIVE_AT, _LIVE.size)
        torque = None if live is None else registers.read(servo_id, "torque_enable")
        if live is None or torque is None:
            return None
        latched = 0
        if registers.error & ALERT:
            latched = registers.read(servo_id, "hardware_error_status") or 0
        return look(joint, live, bool(torque), latched)


def look(joint: JointParams, live: bytes, torque: bool, latched: int) -> Look:
    """Take a Dynamixel servo's registers 116..146 and the rest apart, in units of the joint."""
    goal, effort, velocity, position, voltage, temperature = _LIVE.unpack(live)
    return Look(
        degrees(joint.angle_rad(goal)),
        goal,
        degrees(joint.angle_rad(position)),
        position,
        degrees(velocity * VELOCITY_UNIT_STEPS_S * joint.made().rate_rad(position)),
        DYNAMIXEL.driving.load(joint.model, effort),
        temperature,
        voltage / 10.0,
        torque,
        name_dynamixel(latched),
    )


class FeetechLooks:
    """Looks at Feetech STS servos; one read of 40..70 tells all."""

    _GOAL = STS["goal_position"]

    def __init__(self, registers: Registers) -> None:
        self._registers = registers

    def look(self, joint: JointParams) -> Look | None:
        """Ask a joint's servo; see Looks."""
        data = self._registers.read_bytes(joint.id, ARMED.address, ARMED.length)
        if data is None:
            return None
        said = ARMED.sample(self._registers.error, data)
        goal_at = self._GOAL.address - ARMED.address
        goal = self._GOAL.decode(data[goal_at : goal_at + self._GOAL.size])
        return Look(
            degrees(joint.angle_rad(goal)),
            goal,
            degrees(joint.angle_rad(said.position)),
            said.position,
            degrees(said.velocity * joint.made().rate_rad(said.position)),
            said.load * LOAD_UNIT,
            said.temperature,
            said.voltage / 10.0,
            said.torque == 1,
            name_feetech(said.error),
        )


class MaestroLooks:
    """Looks at the channels of a Maestro: which pulse each gives, and nothing else.

    A board that is still to detect its baud rate waits for the first byte of the Pololu
    form; so where it keeps silent the question is put in that form, too.
    """

    def __init__(self, port: BusPort, params: MaestroParams) -> None:
        self._lines = [Line(port, params), Line(port, replace(params, protocol="pololu"))]

    def look(self, joint: JointParams) -> Look | None:
        """Ask for a joint's pulse; see Looks."""
        found = self._lines[0].pulses((joint.id,))
        if found is None:
            self._lines.reverse()
            return None
        return look_at_pulse(joint, found[0])


class Pca9685Looks:
    """Looks at the channels of PCA9685 boards: which pulse each gives, and nothing else."""

    def __init__(self, port: BusPort, params: Pca9685Params) -> None:
        self._board = Pca9685Board(port, params)

    def look(self, joint: JointParams) -> Look | None:
        """Ask for a joint's pulse; see Looks."""
        found = self._board.pulses((joint.id,))
        return None if found is None else look_at_pulse(joint, found[0])


def look_at_pulse(joint: JointParams, pulse_steps: int) -> Look:
    """Say what the pulse of a joint's channel tells; 0 is none, so nothing holds the servo."""
    if 0 < pulse_steps <= MOST_INPUT:
        return Look(*_UNTOLD, False, ("its channel is an input",), False, None)
    at = degrees(joint.angle_rad(pulse_steps)) if pulse_steps else None
    us = pulse_steps / US_STEPS
    return Look(None, None, at, *_UNTOLD[3:], pulse_steps > 0, (), False, us)


_UNTOLD = (None,) * 8
