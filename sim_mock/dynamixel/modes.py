"""Operating modes of an emulated servo: from registers to its controller.

Gains are divided as the ROBOTIS e-Manual documents (P 128, D 16, I 65536, feed-forward 4). Their
units are not documented. Assumed here: positions in steps, speeds in steps/ms, accelerations in
steps/ms2, sums per ms, in the velocity mode units of 0.229 rev/min; the output is in units of PWM
(885 are 100 %).
"""

from collections.abc import Callable
from math import inf

from gazerig.drivers.dynamixel.control_table import PWM_FULL, VELOCITY_UNIT_STEPS_S, DynamixelModel
from gazerig.sim_mock.smart_servo.physics import Loop

CURRENT, VELOCITY, POSITION, EXTENDED, CURRENT_POSITION, PWM = 0, 1, 3, 4, 5, 16
POSITION_MODES = (POSITION, EXTENDED, CURRENT_POSITION)
MODES = (CURRENT, VELOCITY, POSITION, EXTENDED, CURRENT_POSITION, PWM)
MODES_WITHOUT_CURRENT = (VELOCITY, POSITION, EXTENDED, PWM)

DRIVEN_BY = {CURRENT: "goal_current", VELOCITY: "goal_velocity", PWM: "goal_pwm"}
"""Goal that drives the shaft in modes without a position."""

REVERSE, BY_TIME, TORQUE_ON_BY_GOAL = 1, 4, 8
"""Bits of Drive Mode (10)."""

BY_TIME_SINCE = 42
"""First firmware with the time-based profile."""

PWM_SLOPE_V_MS = 0.001977, 0.003955
"""Unit of PWM Slope (62) of the models for 5 V and for 12 V."""

FAR_BEYOND = 2.0
"""Above full PWM, so that the current limit decides."""

Get = Callable[[str], int]


def modes_of(model: DynamixelModel) -> tuple[int, ...]:
    """Return a model's operating modes."""
    return MODES_WITHOUT_CURRENT if model.current_limit is None else MODES


def loop_of(get: Get, model: DynamixelModel, side: int) -> Loop:
    """Return the controller that the registers describe; ``side`` is -1 in reverse mode."""
    mode = get("operating_mode")
    slew = inf
    if model.family == "x330":
        slew = get("pwm_slope") * PWM_SLOPE_V_MS[model.rated_v > 5.0] / model.rated_v
    limit = get("pwm_limit") / PWM_FULL
    if mode == PWM:
        return Loop(bias=side * get("goal_pwm") / PWM_FULL, u_max=limit, slew=slew)
    limit = min(limit, abs(get("goal_pwm")) / PWM_FULL)
    torque_max = _torque_limit(get, model) if mode in (CURRENT, CURRENT_POSITION) else inf
    if mode == CURRENT:
        goal = side * get("goal_current")
        bias = FAR_BEYOND if goal > 0 else -FAR_BEYOND if goal < 0 else 0.0
        return Loop(bias=bias, u_max=limit, torque_max=torque_max, slew=slew)
    if mode == VELOCITY:
        per_step_ms = 1000.0 / VELOCITY_UNIT_STEPS_S / PWM_FULL
        return Loop(
            d=get("velocity_p_gain") / 128.0 * per_step_ms,
            vi=get("velocity_i_gain") / 65536.0 * per_step_ms,
            u_max=limit,
            slew=slew,
        )
    return Loop(
        p=get("position_p_gain") / 128.0 / PWM_FULL,
        i=get("position_i_gain") / 65536.0 / PWM_FULL,
        d=get("position_d_gain") / 16.0 / PWM_FULL,
        f1=get("feedforward_1st_gain") / 4.0 / PWM_FULL,
        f2=get("feedforward_2nd_gain") / 4.0 / PWM_FULL,
        u_max=limit,
        torque_max=torque_max,
        slew=slew,
    )


def _torque_limit(get: Get, model: DynamixelModel) -> float:
    """Return the torque that the goal current and its limit allow, as a share of stall."""
    units = min(abs(get("goal_current")), get("current_limit"))
    return units * model.current_unit_ma / 1000.0 / model.stall_current_a
