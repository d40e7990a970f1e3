"""Modes, goals and origin of an emulated Feetech servo, between its registers and its shaft.

The registers' position is ``shaft.x + shift``, within one turn unless turns are counted. Shaft
and motor are those of gazerig.sim_mock.smart_servo.motor. Undocumented properties of the
controller are assumed such that a servo with factory gains reaches full duty at 50 steps of error
and does not overshoot: owners measure 20-30 steps at half the stall torque. Omitted: the starting
force (24) and the dead zones (26, 27); without them friction keeps it up to 2 steps from its
goal, as on a real servo.
"""

import struct

from gazerig.drivers.feetech.memory_table import (
    ACCELERATION_UNIT_STEPS_S2,
    CURRENT_UNIT_MA,
    FeetechModel,
)
from gazerig.drivers.feetech.memory_table import STEPS_PER_TURN as TURN
from gazerig.drivers.feetech.memory_table import TORQUE_FULL as FULL
from gazerig.sim_mock.feetech.memory import PWM, SERVO, STEP, WHEEL, FeetechMemory
from gazerig.sim_mock.feetech.packets import signed, unsigned
from gazerig.sim_mock.smart_servo.drive import Drive
from gazerig.sim_mock.smart_servo.motor import ShaftMaker, create_shaft
from gazerig.sim_mock.smart_servo.physics import DISABLED, Loop, Physics, ServoSpec
from gazerig.sim_mock.smart_servo.profile import PositionProfile, SpeedProfile

CURRENT_UNIT_A = CURRENT_UNIT_MA / 1000.0
RAMP_UNIT = ACCELERATION_UNIT_STEPS_S2 / 1e6
"""Unit of Acceleration (41) in steps/ms2."""

FINE_SPEED, ZERO_IS_FASTEST, COUNTS_TURNS = 4, 8, 16
"""Bits of Phase (18)."""
COARSE_STEPS_S = 50

GOALS_AT = 41
GOALS = {"little": struct.Struct("<BHHH"), "big": struct.Struct(">BHHH")}
"""Acceleration, goal position, goal time, goal speed: written together in every tick."""

SIGN = 1 << 15
"""Bit of the sign of most words."""

DAMPED = 2
"""Torque (40): the windings are shorted, which brakes."""

BRAKED = Loop(u_max=0.0)
P_SHARE, I_SHARE, D_SHARE = 1 / 1600, 1 / 1.6e6, 1 / 64
SPEED_P_SHARE, SPEED_I_SHARE = 1 / 50, 1 / 40_000
"""Duty per unit of each gain for steps, steps times ms, and steps/ms, as shares of full duty."""


MotionWords = tuple[int, int, int, int, int, bool]
"""Position, speed, load, current, target and whether it moves, as the words of their registers."""


class FeetechDrive(Drive):
    """Drives the shaft of a Feetech servo."""

    memory: FeetechMemory

    def __init__(
        self,
        memory: FeetechMemory,
        model: FeetechModel,
        spec: ServoSpec,
        make_shaft: ShaftMaker = create_shaft,
    ) -> None:
        table = memory.table
        self._goals = GOALS[table.order]
        self._scale = table.turn_steps / TURN
        self._last = table.last_step
        self._top = model.no_load_rpm / 60.0 * TURN / 1000.0
        self._current_full = model.stall_current_a / CURRENT_UNIT_A
        self._uses_goal_time = True
        physics, scale = Physics(*spec.physics), self._scale
        steps = ("upright_steps", "stop_low_steps", "stop_high_steps")
        here = {name: getattr(physics, name) / scale for name in steps}
        own = spec._replace(physics=physics._replace(**here))
        super().__init__(memory, model, own, scale, make_shaft)

    def boot(self) -> None:
        """Reset to power-on: torque off, position within one turn."""
        self.torque = self.damped = False
        self.max_duty = 1.0
        self.mode = self._configured_mode()
        self._goals_followed: tuple[int, ...] = ()
        self._offset = self.memory.get("position_offset")
        self.shaft.disable()
        self._wrap_to_one_turn()
        self.apply_settings()

    # --- readings

    @property
    def position_steps(self) -> float:
        """Return the true position in the registers' unit, with fractions."""
        at = self.shaft.x + self._shift
        counts_on = self.counts_turns or self.torque or self._last is not None
        return (at if counts_on else at % TURN) * self._scale

    def motion_words(self, now_ms: int) -> MotionWords:
        """Return the register words of position, speed, load, current, target, moving."""
        shaft, scale, profile = self.shaft, self._scale, self.shaft.profile
        at = round((shaft.x + self._shift) * scale)
        if self._last is not None:
            at = max(0, min(self._last, at))
        elif not self.counts_turns:
            at %= TURN
        turning = shaft.v * scale * 1000.0 / self._speed_unit
        speed, current = round(turning), round(shaft.effort * self._current_full)
        if self.torque and not turning:
            more, speed = self._noise_now(now_ms)
            current += more
        led = self.torque and isinstance(profile, PositionProfile)
        goal = self.memory.get("goal_position")
        if led:
            goal = round((profile.goal + self._shift) * scale)
        load = round(shaft.u * FULL)
        # Half of them have no sign: the word is the value.
        return (
            at if 0 <= at < SIGN else unsigned(at, 15),
            speed if 0 <= speed < SIGN else unsigned(speed, 15),
            load if 0 <= load <= FULL else unsigned(load, 10),
            current if 0 <= current < SIGN else unsigned(current, 15),
            goal if 0 <= goal < SIGN else unsigned(goal, 15),
            led and profile.running or not -self._threshold <= turning <= self._threshold,
        )

    # --- settings

    def apply_settings(self) -> None:
        """Apply the present register values."""
        self.followed = None
        get = self.memory.get
        phase, low, high = get("phase"), get("min_position_limit"), get("max_position_limit")
        endless = low == 0 and high == 0
        self.counts_turns = self._last is None and (endless or bool(phase & COUNTS_TURNS))
        self._range = None if endless else (min(low, high), max(low, high))
        self._speed_unit = 1 if phase & FINE_SPEED else COARSE_STEPS_S
        self._stops_at_zero = not phase & ZERO_IS_FASTEST
        self._threshold = get("moving_threshold")
        offset = get("position_offset")
        if offset != self._offset:
            self._shift += self._offset - offset
            self._offset = offset
            if not self.counts_turns:
                self._wrap_to_one_turn()
        if self._configured_mode() != self.mode:
            self.mode = self._configured_mode()
            self._set_goal_here()
            if self.torque:
                self._begin()
        self.apply_gains()

    def _configured_mode(self) -> int:
        """Return the mode from its register, or from the limits for a series without it."""
        get = self.memory.get
        if self._last is not None and get("min_position_limit") == get("max_position_limit") == 0:
            return PWM
        return get("operating_mode")

    def apply_gains(self) -> None:
        """Apply gains, torque limit and, in mode PWM, the duty."""
        self.shaft.drive(self._loop() if self.torque else BRAKED if self.damped else DISABLED)

    def _loop(self) -> Loop:
        get = self.memory.get
        most = min(get("torque_limit") / FULL, self.max_duty, 1.0)
        if self.mode == PWM:
            return Loop(bias=signed(get("goal_time"), 10) / FULL, u_max=most)
        if self.mode == WHEEL:
            damping, sum_up = (
                SPEED_P_SHARE * get("velocity_p_gain"),
                SPEED_I_SHARE * get("velocity_i_gain"),
            )
            return Loop(d=damping, vi=sum_up, u_max=most)
        return Loop(
            p=P_SHARE * get("position_p_gain"),
            i=I_SHARE * get("position_i_gain"),
            d=D_SHARE * get("position_d_gain"),
            u_max=most,
        )

    # --- torque

    def switch(self, value: int, from_here: bool) -> None:
        """Switch the torque: 0 off, 1 on, 2 off and braked; ``from_here``: drop the old goal."""
        self.followed = None
        was, self.torque = self.torque, value not in (0, DAMPED)
        self.damped = value == DAMPED
        if self.torque and not was:
            if not self.counts_turns:
                self._wrap_to_one_turn()
            if from_here:
                self._set_goal_here()
            self._begin()
        elif was and not self.torque:
            self.shaft.disable()
        self.apply_gains()

    def _begin(self) -> None:
        """Start a profile at the shaft's position."""
        self.followed = None
        self._goals_followed = ()
        self._start_profile(self.mode == WHEEL)
        self.apply_gains()
        if self.mode != STEP:
            self.follow()

    # --- goals

    def obey_goal_time(self, obeyed: bool) -> None:
        """Choose whether Goal Time is used."""
        self._uses_goal_time = obeyed

    def follow(self, new_goal: bool = False) -> None:
        """Follow the goal registers; ``new_goal``: the goal position has just been written."""
        if not self.torque:
            return
        asked = self._goals.unpack_from(self.memory.bytes, GOALS_AT)
        profile = self.shaft.profile
        if isinstance(profile, SpeedProfile):
            speed = signed(asked[3], 15) * self._speed_unit / self._scale / 1000.0
            profile.set_goal(max(-self._top, min(self._top, speed)), asked[0] * RAMP_UNIT)
            self.shaft.resume()
        elif self.mode == PWM:
            self.apply_gains()
        elif self.mode == SERVO:
            goal = signed(asked[1], 15)
            if self._range is not None:
                goal = max(self._range[0], min(self._range[1], goal))
            place = goal / self._scale - self._shift
            if asked != self._goals_followed or place != profile.goal:
                self._goals_followed = asked
                self._plan_path(profile, place, asked)
        elif self.mode == STEP and new_goal:
            self._plan_path(profile, profile.goal + signed(asked[1], 15) / self._scale, asked)

    def _plan_path(self, profile: PositionProfile, to: float, asked: tuple[int, ...]) -> None:
        """Plan the profile to a position, in a time or at goal speed and acceleration."""
        ramp, _, time_ms, speed = asked
        cruise = abs(signed(speed, 15)) * self._speed_unit / self._scale / 1000.0
        if cruise == 0.0 and self._stops_at_zero:
            return
        if time_ms and self._uses_goal_time and self.mode == SERVO:
            # No faster than possible: the next path begins at the speed of this one.
            profile.plan_by_time(to, max(time_ms, abs(to - profile.r) / self._top), 0.0)
        else:
            profile.plan_by_velocity(to, min(cruise or self._top, self._top), ramp * RAMP_UNIT)
        self.shaft.resume()

    # --- origin

    def _wrap_to_one_turn(self) -> None:
        """Wrap the position into one turn, as power-on does."""
        turns = 0 if self._last is not None else (self.shaft.x - self._offset) // TURN
        self._shift = -self._offset - int(turns) * TURN

    def calibrate(self, to: int) -> None:
        """Set the present position to ``to``; the offset is stored permanently."""
        if self._last is not None:
            return
        offset = (round(self.shaft.x) - to + TURN // 2) % TURN - TURN // 2
        self.memory.set_permanently("position_offset", offset)
        self.apply_settings()
        self._set_goal_here()

    def forget_turns(self) -> None:
        """Reset the count of turns; under torque the shaft does not move."""
        self._wrap_to_one_turn()
        self._set_goal_here()
        if self.torque:
            self._begin()

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand."""
        self.shaft.turn(steps / self._scale)
