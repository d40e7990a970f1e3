"""Feetech STS servos as a family of the servo bus."""

from typing import TYPE_CHECKING

from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.feetech import protocol
from gazerig.drivers.feetech.memory_table import (
    BAUD_RATES,
    HIGHEST_ID,
    MODELS,
    MULTI_TURN,
    REGISTERS,
    SCS_MODELS,
    SET_MIDDLE,
    STEPS_PER_TURN,
    TORQUE_FULL,
    acceleration_units,
    name_errors,
    speed_units,
)
from gazerig.drivers.feetech.protocol import MOST_GOALS, GoalWrite
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Family, Window
from gazerig.drivers.servo_bus.registers import Registers

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

POSITION_MODE = 0


def wanted_settings(setup: "ServoConfig") -> dict[str, int]:
    """Return the required register values by name, in register units.

    For "phase" only the multi-turn bit is required: it must be 0.
    """
    wanted = {
        "return_delay_time": 0,
        "status_return_level": 1,
        "min_position_limit": max(0, setup.min_steps),
        # 0 for both limits would mean no limits.
        "max_position_limit": max(1, setup.max_steps),
        "phase": 0,
        "angular_resolution": 1,
        "operating_mode": POSITION_MODE,
        "lock": 1,
    }
    if setup.strength is not None:
        wanted["torque_limit"] = round(setup.strength * TORQUE_FULL)
    if setup.gains is not None:
        names = ("position_p_gain", "position_i_gain", "position_d_gain")
        wanted |= dict(zip(names, setup.gains, strict=True))
    return wanted


SENSED = ("position", "velocity", "effort", "voltage", "temperature", "status")
SIGNS = (15, 15, 10)
"""Sign bits of Present Position, Velocity and Load."""


FEETECH = Family(
    name="feetech",
    codec=protocol,
    registers=REGISTERS,
    models={**MODELS, **SCS_MODELS},
    steps_per_turn=STEPS_PER_TURN,
    name_errors=name_errors,
    velocity_unit_steps_s=1.0,
    speed_units=speed_units,
    acceleration_units=acceleration_units,
    create_goal_packets=GoalWrite,
    sync_read=True,
    baud_rates=BAUD_RATES,
    scan_rates=BAUD_RATES,
    factory_baud=1_000_000,
    highest_id=HIGHEST_ID,
    format_firmware=lambda firmware: f"{firmware // 100}.{firmware % 100}",
    # Present Position to Status (56..65).
    window=Window(56, "<HHHBBxB", SENSED, SIGNS),
    polled=(("torque_enable", "torque_limit"),),
    has_fast_read=lambda model, firmware: False,
    prompt_timeout_s=0.002,
    effort_register="present_load",
    read_spans=(("return_delay_time", "operating_mode"), ("torque_limit", "lock")),
    wanted_settings=wanted_settings,
    # Only one bit of Phase is changed; the others keep their values.
    corrected_value=lambda name, found, wanted: found & ~MULTI_TURN if name == "phase" else wanted,
    answer_level=1,
    lock_register="lock",
    error_register="status",
    faults_latch=False,
    watchdog_unit_s=None,
    goal_speed=True,
    single_turn=True,
    duplicate_id_registers=("present_position", "present_current"),
    arming_register="acceleration",
    most_goals=MOST_GOALS,
    fault_cure="check its supply",
    jump_cure="restart the servo power",
)


MIDDLE = STEPS_PER_TURN // 2

NEAR_STEPS = 8
"""Motion of the joint caused by a hand's tremor during the setting."""


def set_middle(port: BusPort, family: Family, servo_id: int) -> int:
    """Set the present position of a servo without torque to 2048; return its offset in steps.

    The servo computes the offset (31) itself on request (Torque Enable := 128) and keeps it in its
    EEPROM. Earlier calibrations in steps are invalid afterwards. Source: Feetech memory table
    STS3215, register 40.

    Raises:
        ServoMissing: it does not answer.
        ServoFault: its torque is on, or it rejects the instruction.
        BusLost: the port is lost.
    """
    registers = Registers(port, family)
    where = f"{port.port_name}: servo {servo_id}"
    torque = registers.read(servo_id, "torque_enable")
    if torque:
        raise ServoFault(f"{where} has its torque on: switch it off before its middle is set")
    if torque is None or not registers.write(servo_id, "lock", 0):
        fault, remedy = f"{where} does not answer", "check its cable and servo power"
        raise ServoMissing(registers.lateness.blame(fault, remedy, port.now_s()))
    registers.write(servo_id, "torque_enable", SET_MIDDLE)
    # Some firmware leaves torque on.
    off = registers.write(servo_id, "torque_enable", 0)
    locked = registers.write(servo_id, "lock", 1)
    place, offset = registers.read(servo_id, "present_position"), None
    if place is not None and abs(place - MIDDLE) <= NEAR_STEPS:
        offset = registers.read(servo_id, "position_offset")
    if offset is None or not off or not locked:
        raise ServoFault(
            f"{where} does not accept its present position as its middle (it reads {place}): "
            "switch its power off and on and try again"
        )
    return offset
