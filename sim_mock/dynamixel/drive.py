"""Modes, goals and origin of an emulated Dynamixel servo, between its registers and its shaft.

The registers' position is ``side * shaft.x + shift``. Gains are divided as the ROBOTIS e-Manual
documents (P 128, D 16, I 65536, feed-forward 4). Their units are not documented. Assumed here:
positions in steps, speeds in steps/ms, accelerations in steps/ms2, sums per ms, in the velocity
mode units of 0.229 rev/min; the output is in units of PWM (885 are 100 %).
"""

from collections.abc import Callable
from math import inf

from gazerig.drivers.dynamixel.control_table import (
    ACCELERATION_UNIT_STEPS_S2,
    GAINS,
    PWM_FULL,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
    DynamixelModel,
)
from gazerig.sim_mock.dynamixel.memory import DynamixelMemory
from gazerig.sim_mock.smart_servo.drive import Drive
from gazerig.sim_mock.smart_servo.motor import ShaftMaker, create_shaft
from gazerig.sim_mock.smart_servo.physics import DISABLED, Loop, Quirks, ServoSpec
from gazerig.sim_mock.smart_servo.profile import PositionProfile, SpeedProfile
from gazerig.sim_mock.smart_servo.quirks import LENGTH

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
"""Value above full PWM, so that only the current limit applies."""

Get = Callable[[str], int]


def supported_modes(model: DynamixelModel) -> tuple[int, ...]:
    """Return a model's operating modes."""
    return MODES_WITHOUT_CURRENT if model.current_limit is None else MODES


def control_loop(get: Get, model: DynamixelModel, side: int) -> Loop:
    """Return the controller that the registers describe; ``side`` is -1 in reverse mode."""
    mode = get("operating_mode")
    slew = inf
    if model.family == "x330":
        slew = get("pwm_slope") * PWM_SLOPE_V_MS[model.rated_v > 5.0] / model.rated_v
    limit = get("pwm_limit") / PWM_FULL
    if mode == PWM:
        return Loop(bias=side * get("goal_pwm") / PWM_FULL, u_max=limit, slew=slew)
    limit = min(limit, abs(get("goal_pwm")) / PWM_FULL)
    torque_max = inf
    if mode in (CURRENT, CURRENT_POSITION):
        # The goal current and its limit, as a share of the stall torque.
        units = min(abs(get("goal_current")), get("current_limit"))
        torque_max = units * model.current_unit_ma / 1000.0 / model.stall_current_a
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


TRIPPED = 255
"""Value of Bus Watchdog (98) after it has stopped the servo."""

HOMING_ACTS_STEPS = 1024
"""Part of the homing offset that counts in position mode."""

LARGEST = 32767
"""Largest number that Present Current can hold."""

ARRIVED, RUNNING, ASTRAY = 1, 2, 8
"""Bits of Moving Status (123): in position, profile ongoing, following error."""

IN_POSITION_STEPS = 12
FOLLOWING_STEPS = 100
"""Thresholds of in position and following error; the maker does not document them."""

_WATCHDOG_AT = 98
_SPEED_UNIT = VELOCITY_UNIT_STEPS_S / 1000.0
_RAMP_UNIT = ACCELERATION_UNIT_STEPS_S2 / 1e6


class DynamixelDrive(Drive):
    """Drives the shaft of a Dynamixel servo."""

    memory: DynamixelMemory

    def __init__(
        self,
        memory: DynamixelMemory,
        model: DynamixelModel,
        spec: ServoSpec,
        make_shaft: ShaftMaker = create_shaft,
    ) -> None:
        self._model = model
        self._quirks = Quirks(*spec.quirks)
        unit = model.current_unit_ma
        # Models without a current sensor report load in 0.1 %.
        self._current_full = model.stall_current_a * 1000.0 / unit if unit else 1000.0
        self._max_current = LARGEST if unit else 1000
        super().__init__(memory, model, spec, make_shaft=make_shaft)

    def boot(self) -> None:
        """Reset to power-on: torque off, position within one turn, goals at their start values."""
        self.torque = False
        self.shaft.disable()
        self.mode = self.memory.get("operating_mode")
        self.wrap_to_one_turn()
        self.reset_goals()
        self.apply_settings()

    # --- readings

    @property
    def position_steps(self) -> float:
        """Return the true position of the shaft in the registers' unit, with fractions."""
        return self._side * self.shaft.x + self._shift

    @property
    def joint_steps(self) -> float:
        """Return the position of the joint behind the play, in the registers' unit."""
        return self._side * self.shaft.joint + self._shift

    def sensed(self, now_ms: int) -> tuple[int, int, int]:
        """Return present current, velocity and position in register units."""
        shaft, side = self.shaft, self._side
        v, at = shaft.v, round(side * shaft.x + self._shift)
        current = round(side * shaft.effort * self._current_full)
        if v:
            return current, round(side * v / _SPEED_UNIT), at
        if not self.torque:
            return 0, 0, at
        amps, speed = self._noise[now_ms + self._noise_from_ms & LENGTH - 1]
        amps, most = amps + current, self._max_current
        return (amps if -most <= amps <= most else most if amps > 0 else -most), speed, at

    def motion(self, now_ms: int) -> tuple[bool, int, int]:
        """Return moving, moving status and PWM in register units."""
        shaft, profile, (_, velocity, position) = (
            self.shaft,
            self.shaft.profile,
            self.sensed(now_ms),
        )
        running = self.torque and profile.running and profile.v != profile.goal
        status = running * RUNNING | profile.kind << 4
        if self.torque and self.mode in POSITION_MODES:
            goal = self.memory.get("goal_position")
            status |= (not running and abs(goal - position) <= IN_POSITION_STEPS) * ARRIVED
            status |= (abs(profile.r - shaft.x) > FOLLOWING_STEPS) * ASTRAY
        moving = running or abs(velocity) > self.memory.get("moving_threshold")
        return moving, status, round(self._side * shaft.u * PWM_FULL)

    def reference(self) -> tuple[int, int]:
        """Return the profile's velocity and position, in register units."""
        shaft, side, profile = self.shaft, self._side, self.shaft.profile
        place = shaft.x if isinstance(profile, SpeedProfile) else profile.r
        return round(side * profile.v / _SPEED_UNIT), round(side * place + self._shift)

    # --- goals

    def set_goal(self, goal: int) -> None:
        """Plan the profile to a goal position; an equal goal changes nothing."""
        shaft = self.shaft
        profile, to = shaft.profile, float(self._side * (goal - self._shift))
        if isinstance(profile, PositionProfile) and to != profile.goal:
            if self._by_time:
                profile.plan_by_time(to, self._speed, self._ramp)
            else:
                profile.plan_by_velocity(to, self._speed * _SPEED_UNIT, self._ramp * _RAMP_UNIT)
            shaft.resume()

    def set_goal_velocity(self, speed: int) -> None:
        """Plan the profile to a goal velocity."""
        profile = self.shaft.profile
        if isinstance(profile, SpeedProfile):
            ramp = 0.0 if self._by_time else self._ramp * _RAMP_UNIT
            profile.set_goal(self._side * speed * _SPEED_UNIT, ramp)
            self.shaft.resume()

    def hold_position(self) -> None:
        """Stop at the present position under torque until a new goal arrives."""
        shaft = self.shaft
        if isinstance(shaft.profile, SpeedProfile):
            shaft.profile.set_goal(0.0, 0.0)
        else:
            shaft.profile.rest(shaft.x)
        self.apply_settings()
        shaft.resume()

    # --- torque and mode

    def switch(self, on: bool) -> None:
        """Switch the torque; a stored goal is followed immediately."""
        was, self.torque = self.torque, on
        if on and not was:
            self._start_profile(self.mode == VELOCITY)
            if self._quirks.wrap_at_torque_on and self.mode == POSITION and self._offset:
                self._shift -= int(self.position_steps // STEPS_PER_TURN) * STEPS_PER_TURN
            if self._quirks.goal_at_torque_on:
                self._set_goal_here()
            self.apply_settings()
            if self.mode in POSITION_MODES:
                self.set_goal(self.memory.get("goal_position"))
            elif self.mode == VELOCITY:
                self.set_goal_velocity(self.memory.get("goal_velocity"))
        elif not on and was:
            self.shaft.disable()
        self.apply_settings()

    def change_mode(self, mode: int) -> None:
        """Set profile, gains, goals to a mode's start values, the position within one turn."""
        if mode == self.mode:
            return
        self.mode = mode
        for name in ("profile_acceleration", "profile_velocity"):
            self.memory.set(name, 0)
        for name, gain in zip(GAINS, self._model.gains, strict=True):
            self.memory.set(name, gain)
        for name in ("feedforward_1st_gain", "feedforward_2nd_gain"):
            self.memory.set(name, 0)
        self.wrap_to_one_turn()
        self.reset_goals()

    def reset_goals(self) -> None:
        """Set the goals to the limits, and the goal position to the present position.

        Goals that drive the shaft continuously start at 0. This is not documented, but owners would
        have reported servos that run away when the torque is switched on.
        """
        for name in ("goal_pwm", "goal_current", "goal_velocity"):
            if self.memory.has(name):
                limit = self.memory.get(name.replace("goal_", "") + "_limit")
                self.memory.set(name, 0 if DRIVEN_BY.get(self.mode) == name else limit)
        self._set_goal_here()

    # --- origin

    def wrap_to_one_turn(self) -> None:
        """Wrap the position into one turn, as power-on and a change of mode do."""
        self._side = -1 if self.memory.get("drive_mode") & REVERSE else 1
        self._offset = self._homing()
        turns = int(self._side * self.shaft.x // STEPS_PER_TURN)
        self._shift = self._offset - turns * STEPS_PER_TURN

    def shift_origin(self) -> None:
        """Apply a changed homing offset or a changed direction."""
        side = -1 if self.memory.get("drive_mode") & REVERSE else 1
        if side != self._side:
            self.wrap_to_one_turn()
        else:
            offset = self._homing()
            self._shift += offset - self._offset
            self._offset = offset

    def _homing(self) -> int:
        offset = self.memory.get("homing_offset")
        if self.mode != POSITION:
            return offset
        return max(-HOMING_ACTS_STEPS, min(HOMING_ACTS_STEPS, offset))

    def clear_turns(self) -> bool:
        """Wrap a multi-turn position into one turn; return False while moving."""
        if self.shaft.v or (self.torque and self.shaft.profile.running):
            return False
        turns = int(self.position_steps // STEPS_PER_TURN)
        self._shift -= turns * STEPS_PER_TURN
        self._set_goal_here()
        return True

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, in the registers' direction."""
        self.shaft.turn(self._side * steps)

    def apply_settings(self) -> None:
        """Apply the present register values."""
        self.followed = None
        get = self.memory.get
        self.follows = self.torque and self.mode in POSITION_MODES
        self._speed, self._ramp = get("profile_velocity"), get("profile_acceleration")
        timed = get("firmware_version") >= BY_TIME_SINCE
        self._by_time = timed and bool(get("drive_mode") & BY_TIME)
        halted = self.memory.bytes[_WATCHDOG_AT] == TRIPPED
        loop = control_loop(get, self._model, self._side) if self.torque else DISABLED
        self.shaft.drive(loop._replace(bias=0.0) if halted else loop)
