"""Dynamixel X servos (Protocol 2.0) as a family of the servo bus."""

from typing import TYPE_CHECKING

from gazerig.drivers.dynamixel import protocol
from gazerig.drivers.dynamixel.control_table import (
    BAUD_RATES,
    FAST_READ_SINCE,
    HARDWARE_ERRORS,
    MODELS,
    PWM_FULL,
    REGISTERS,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
    WATCHDOG_UNIT_S,
    acceleration_units,
)
from gazerig.drivers.servo_bus.family import Family, Window

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

POSITION_MODE = 3

STEEPEST_PWM = 255
"""PWM Slope. With the factory value 140 a motor needs 36 ms from full drive to full brake, during
which a lid at 600 deg/s overshoots by 4 deg."""


def wanted_settings(setup: "ServoConfig") -> dict[str, int]:
    """Return the required register values by name, in register units."""
    model = MODELS[setup.model]
    speed = DYNAMIXEL.speed_units(setup.max_speed_steps_s)
    wanted = {"return_delay_time": 0, "drive_mode": 0, "operating_mode": POSITION_MODE}
    if setup.strength is not None:
        wanted["pwm_limit"] = round(setup.strength * PWM_FULL)
    if model.series == "x330":
        wanted["pwm_slope"] = STEEPEST_PWM
    wanted["velocity_limit"] = min(speed, model.velocity_limit)
    wanted["max_position_limit"] = setup.max_steps
    wanted["min_position_limit"] = setup.min_steps
    if setup.gains is not None:
        names = ("position_d_gain", "position_i_gain", "position_p_gain")
        wanted |= dict(zip(names, reversed(setup.gains), strict=True))
    wanted["profile_acceleration"] = acceleration_units(setup.max_accel_steps_s2)
    wanted["profile_velocity"] = speed
    return wanted


DYNAMIXEL = Family(
    name="dynamixel",
    codec=protocol,
    registers=REGISTERS,
    models=MODELS,
    steps_per_turn=STEPS_PER_TURN,
    errors={1 << bit: text for bit, text in HARDWARE_ERRORS.items()},
    error_register="hardware_error_status",
    effort_register="present_current",
    velocity_unit_steps_s=VELOCITY_UNIT_STEPS_S,
    acceleration_units=acceleration_units,
    goal_layout="<Bi",
    goal_speed=False,
    arming_register="profile_velocity",
    most_goals=253,
    sync_read=True,
    fast_read_since={name: FAST_READ_SINCE[model.series] for name, model in MODELS.items()},
    baud_rates=BAUD_RATES,
    factory_baud=57_600,
    highest_id=252,
    format_firmware=str,
    updater="Dynamixel Wizard 2.0",
    # Present Current, Velocity and Position (126..135).
    window=Window(126, "<hii", ("effort", "velocity", "position")),
    # Between them are addresses without a register, whose reads are refused.
    polled=(
        ("torque_enable", "torque_enable"),
        ("hardware_error_status", "hardware_error_status"),
        ("present_input_voltage", "present_temperature"),
    ),
    # In this order, as a new operating mode resets gains and profile.
    read_spans=(
        ("return_delay_time", "operating_mode"),
        ("pwm_limit", "pwm_limit"),
        ("pwm_slope", "pwm_slope"),
        ("velocity_limit", "min_position_limit"),
        ("position_d_gain", "position_p_gain"),
        ("profile_acceleration", "profile_velocity"),
    ),
    wanted_settings=wanted_settings,
    # A velocity limit higher than needed may stay.
    corrected_value=lambda name, found, wanted: (
        max(found, wanted) if name == "velocity_limit" else wanted
    ),
    answer_level=2,
    lock_register=None,
    faults_latch=True,
    watchdog_unit_s=WATCHDOG_UNIT_S,
    single_turn=False,
)
