"""Channel of a board: its commanded pulse and its servo's estimated position."""

from collections import deque
from math import ceil, inf, sqrt

from gazerig.drivers.bus.goal_limits import entry_speed_steps_s
from gazerig.drivers.hobby_board.params import HOBBY
from gazerig.drivers.types import ServoConfig

_SLICE_S = 0.005
_LONG_S = 5.0
"""Time after which any pulse has arrived."""


class Ramp:
    """Ramp of one channel's pulse and shaft.

    A pulse moves towards its goal at a limited speed and acceleration, ramped by the board or by
    the driver. The servo's shaft follows the pulse at its own speed. The shaft is not measured: the
    result is an estimate, which is wrong for a stuck or loaded servo. Steps are quarter
    microseconds.

    pulse_steps: present pulse; shaft_steps, shaft_steps_s: estimated position and speed of the
        servo
    speed_steps_s, accel_steps_s2: limits of the pulse; 0: unlimited
    shaft_speed_steps_s: speed of the servo itself
    """

    def __init__(self, place_steps: float, shaft_speed_steps_s: float) -> None:
        self.shaft_speed_steps_s = shaft_speed_steps_s
        self.speed_steps_s = self.accel_steps_s2 = 0.0
        self.shaft_steps = place_steps
        self.begin(place_steps)

    def begin(self, pulse_steps: float) -> None:
        """Record that pulses begin, or already are, at a width; the shaft does not move."""
        self.pulse_steps = pulse_steps
        self.shaft_steps_s = 0.0
        self._pulse_steps_s = 0.0

    def stop(self) -> None:
        """Record that there are no pulses: the shaft is assumed not to move."""
        self.begin(self.shaft_steps)

    def set_pulse(self, pulse_steps: float) -> None:
        """Record the width that the board reports."""
        self.pulse_steps = pulse_steps

    def longest_s(self, way_steps: float) -> float:
        """Return a time within which a pulse has moved this distance from rest, seconds."""
        speed, accel = self.speed_steps_s, self.accel_steps_s2
        cruise_s = way_steps / speed if speed else 0.0
        return cruise_s + (2.0 * sqrt(way_steps / accel) if accel else 0.0)

    def advance(self, goal_steps: float, for_s: float) -> None:
        """Advance the pulse and the shaft towards a goal."""
        if for_s <= 0.0:
            return
        if self.pulse_steps == goal_steps == self.shaft_steps:
            self._pulse_steps_s = self.shaft_steps_s = 0.0
            return
        pulse, shaft, slices = self.pulse_steps, self.shaft_steps, 1
        if for_s <= _LONG_S:
            slices = ceil(for_s / _SLICE_S)
        slice_s = for_s / slices
        limit, accel, pulse_steps_s = self.speed_steps_s, self.accel_steps_s2, self._pulse_steps_s
        at_once = slice_s > _LONG_S or not (limit or accel)
        reach = self.shaft_speed_steps_s * slice_s
        for _ in range(slices):
            left = goal_steps - pulse
            if at_once or left == 0.0:
                pulse, pulse_steps_s = goal_steps, 0.0
            else:
                way, far = (1.0, left) if left > 0.0 else (-1.0, -left)
                speed = limit or far / slice_s
                if accel:
                    towards = max(0.0, way * pulse_steps_s)
                    speed = min(speed, towards + accel * slice_s, sqrt(2.0 * accel * far))
                if speed * slice_s >= far:
                    pulse, pulse_steps_s = goal_steps, way * far / slice_s
                else:
                    pulse += way * speed * slice_s
                    pulse_steps_s = way * speed
            shaft += min(reach, max(-reach, pulse - shaft))
        self.shaft_steps_s = (shaft - self.shaft_steps) / for_s
        self.pulse_steps, self.shaft_steps, self._pulse_steps_s = pulse, shaft, pulse_steps_s


RECENT_S = 0.1
"""Longest delay of the board behind the last goals: its period is 20 ms, and lines are slow."""

BEHIND_S = 0.04
FINE_STEPS = 8
"""Tolerance of an expected pulse: time of travel in seconds, and steps."""


class Channel:
    """A servo without feedback; the ramp estimates its position.

    on: whether it outputs pulses, as far as known
    held: whether it follows goals
    entering: whether it moves slowly into its limits
    rearmed: whether it was enabled again and that is not yet reported
    fault: reason why it stays without pulses; "" for none
    reported: whether a difference between its pulses and the commanded ones was reported
    sent_steps: pulse that was last sent, if the driver ramps it

    Args:
        setup: The servo.
        longest_ramp_s: Longest time for which the driver's ramp advances while nothing is sent,
            seconds.
    """

    def __init__(self, setup: ServoConfig, longest_ramp_s: float = inf) -> None:
        self._longest_lead_s = longest_ramp_s
        self.setup = setup
        self.id = setup.id
        self.on = self.held = self.entering = self.rearmed = self.off_goal_reported = False
        self.fault = ""
        self.goal_steps = self.clip(_rest_steps(setup))
        self.ramp = Ramp(self.goal_steps, _own_speed_steps_s(setup))
        self._is_position_known = False
        self._at_s = -inf
        self._settled_s = inf
        self._recent: deque[tuple[float, int]] = deque()
        self._bottom, self._top = -inf, inf
        self._end_steps = 0
        self.sent_steps = 0

    def set_target(self, setup: ServoConfig) -> None:
        """Apply a changed setup of the same servo."""
        self.setup = setup
        self.ramp.shaft_speed_steps_s = _own_speed_steps_s(setup)
        if not self._is_position_known:
            self.goal_steps = self.clip(_rest_steps(setup))
            self.ramp.shaft_steps = self.goal_steps

    def clip(self, steps: float) -> int:
        """Return the nearest goal within the limits.

        Raises:
            ValueError: ``steps`` is not a number.
        """
        low, high = self.setup.min_steps, self.setup.max_steps
        if low <= steps <= high:
            return int(steps)
        if steps != steps:
            raise ValueError("a goal is not a number: every goal must be a whole number of steps")
        return low if steps < low else high

    # --- commands

    @property
    def top_speed_steps_s(self) -> float:
        """Return the present speed limit of its pulses, low while it enters its limits."""
        if self.entering:
            return entry_speed_steps_s(self.setup, HOBBY["hobby"].steps_per_turn)
        return self.setup.max_speed_steps_s

    def start(self, pulse_steps: int, now_s: float) -> int:
        """Hold at the present pulse, or at the last position if there is none; return the goal."""
        self.goal_steps = self.clip(pulse_steps or round(self.ramp.shaft_steps))
        self.entering = pulse_steps not in (0, self.goal_steps)
        if not (self.on and pulse_steps):
            # A first pulse is not ramped, as there is no pulse to ramp from.
            self.ramp.begin(pulse_steps or self.goal_steps)
        self.on, self.fault, self.off_goal_reported = True, "", False
        self._at_s = now_s
        self._settled_s = inf
        self._recent.clear()
        self._bottom, self._top = -inf, inf
        return self.goal_steps

    def record_hold(self) -> None:
        """Record that it holds its goal and follows new ones."""
        self.held = self._is_position_known = True

    def record_release(self) -> None:
        """Record that it follows no goals any more; its pulses may continue."""
        self.held = self.entering = self.rearmed = False

    def record_stop(self) -> None:
        """Record that it outputs no pulses: its servo has no torque."""
        self.record_release()
        self.on = False
        self.ramp.stop()

    def record_goal(self, goal_steps: int, now_s: float) -> None:
        """Record a goal that was sent."""
        self.advance(now_s)
        recent = self._recent
        recent.append((now_s, self.goal_steps))
        if recent[0][0] < now_s - RECENT_S:
            self._forget(now_s)
        if goal_steps != self.goal_steps or self._settled_s == inf:
            way = abs(goal_steps - self.ramp.pulse_steps)
            self._settled_s = now_s + self.ramp.longest_s(way) + RECENT_S
        self.goal_steps = goal_steps

    # --- estimated state

    def advance(self, now_s: float) -> None:
        """Advance the estimate to ``now_s``."""
        spent_s = now_s - self._at_s
        if self.on and 0.0 < spent_s < inf:
            if spent_s > self._longest_lead_s:
                # The ramp was paused, so it begins from rest.
                self.ramp.advance(self.ramp.pulse_steps, spent_s - self._longest_lead_s)
                spent_s = self._longest_lead_s
            goal = self.goal_steps
            self.ramp.advance(
                goal if self._bottom <= goal <= self._top else self._reachable_pulse(goal), spent_s
            )
        self._at_s = now_s

    def is_implausible(self, pulse_steps: int, now_s: float, led_away: bool = False) -> bool:
        """Return whether a pulse cannot result from recent goals.

        led_away: whether an error or a restart has briefly moved it towards its home
        """
        if not pulse_steps:
            return True
        if self._longest_lead_s < inf:
            return abs(pulse_steps - self.sent_steps) > FINE_STEPS
        self._forget(now_s)
        places = [goal for _, goal in self._recent]
        places.append(self.goal_steps)
        room: float = FINE_STEPS
        if led_away or now_s < self._settled_s:
            places.append(round(self.ramp.pulse_steps))
            room = self.pulse_tolerance_steps()
        low, high = self._reachable_pulse(min(places)), self._reachable_pulse(max(places))
        return not low - room <= pulse_steps <= high + room

    def _reachable_pulse(self, steps: float) -> float:
        """Return the pulse that a goal ends at, as far as the board's own range is known."""
        return min(self._top, max(self._bottom, steps))

    def _forget(self, now_s: float) -> None:
        while self._recent and self._recent[0][0] < now_s - RECENT_S:
            self._recent.popleft()

    def pulse_tolerance_steps(self) -> float:
        """Return the tolerance of an expected pulse, steps."""
        return FINE_STEPS + self.ramp.speed_steps_s * BEHIND_S

    def adopt_pulse(self, pulse_steps: int) -> None:
        """Adopt the pulse width that the board reports."""
        if pulse_steps and not self.held:
            self.goal_steps = pulse_steps
        if pulse_steps and self.held and not self.entering:
            # No goal is outside, so a byte was damaged; answers have no checksum.
            pulse_steps = self.clip(pulse_steps)
        self.record_pulse(pulse_steps)

    def record_expected_pulse(self, pulse_steps: int) -> None:
        """Record that its pulse is as expected.

        A pulse that the driver ramps is by now beyond the last one sent.
        """
        if self._longest_lead_s == inf:
            self.adopt_pulse(pulse_steps)

    def record_pulse(self, pulse_steps: int) -> None:
        """Record its pulse, which may differ from its goal."""
        self.on = pulse_steps > 0
        if self.on:
            self.ramp.set_pulse(pulse_steps)
        else:
            self.ramp.stop()

    def is_off_goal(self, pulse_steps: int) -> bool:
        """Record the end of a move; return whether it ended off goal twice at the same pulse."""
        before, self._end_steps = self._end_steps, pulse_steps
        short = self.goal_steps - pulse_steps
        self._bottom = -inf
        self._top = inf
        self.ramp.set_pulse(pulse_steps)
        if before != pulse_steps or abs(short) <= FINE_STEPS:
            return False
        if short > 0:
            self._top = pulse_steps
        else:
            self._bottom = pulse_steps
        return True

    def adopt_position(self, pulse_steps: int) -> None:
        """Adopt a pulse as the servo's position, as it has been unchanged for a long time."""
        self.adopt_pulse(pulse_steps)
        if pulse_steps:
            self.ramp.shaft_steps = pulse_steps
            self._is_position_known = True

    def is_within_limits(self) -> bool:
        """Return whether the pulse is within the limits."""
        return self.is_pulse_allowed(self.ramp.pulse_steps)

    def is_pulse_allowed(self, pulse_steps: float) -> bool:
        """Return whether a pulse is within the limits."""
        return self.setup.min_steps <= pulse_steps <= self.setup.max_steps

    def record_rearm(self) -> None:
        """Record that it was enabled again: plans must begin at its pulse."""
        self.rearmed = True
        self.ramp.shaft_steps = self.ramp.pulse_steps

    def pop_rearmed(self) -> bool:
        """Return whether plans must begin at its pulse; True once after it was enabled."""
        rearmed, self.rearmed = self.rearmed, False
        return rearmed or self.entering


def _rest_steps(setup: ServoConfig) -> float:
    middle = (setup.min_steps + setup.max_steps) // 2
    return middle if setup.rest_steps is None else setup.rest_steps


def _own_speed_steps_s(setup: ServoConfig) -> float:
    return setup.own_speed_steps_s or setup.max_speed_steps_s
