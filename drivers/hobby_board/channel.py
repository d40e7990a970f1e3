"""One servo on a board without feedback: where its pulse is, and whether it follows goals."""

from math import inf

from gazerig.drivers.bus.goal_limits import entry_speed_steps_s
from gazerig.drivers.bus.servo_models import HOBBY_STEPS_PER_TURN, US_STEPS
from gazerig.drivers.types import ServoConfig

BEHIND_S = 0.1
"""Longest delay of the board behind the last goals: its period is 20 ms, and lines are slow."""

FINE_STEPS = 24
"""Tolerance of an expected pulse at rest, half a degree: the grain of a PCA9685 is 20 steps."""


class Channel:
    """A servo without feedback, assumed to be at its pulse. Steps are quarter microseconds.

    pulse_steps, mean_steps_s: present pulse, and the mean speed of its last advance
    speed_steps_s: armed limit of its speed
    on: whether it outputs pulses, as far as known
    held, due: whether it follows goals, or is to be held again
    entering: whether it moves slowly into its limits

    Args:
        setup: The servo.
        longest_ramp_s: Longest time for which the driver's ramp advances while nothing is sent,
            seconds; inf: the board itself ramps its pulses.
    """

    def __init__(self, setup: ServoConfig, longest_ramp_s: float = inf) -> None:
        self._longest_ramp_s = longest_ramp_s
        self.id, self.label = setup.id, setup.label("channel")
        self.on = self.held = self.due = self.entering = False
        self.pulse_steps = self.mean_steps_s = 0.0
        self.speed_steps_s = setup.max_speed_steps_s
        self._is_position_known, self._at_s = False, -inf
        self.set_target(setup)

    def set_target(self, setup: ServoConfig) -> None:
        """Apply a changed setup of the same servo."""
        self.setup = setup
        if not self._is_position_known:
            middle = (setup.min_steps + setup.max_steps) // 2
            self.goal_steps = self._clip(middle if setup.rest_steps is None else setup.rest_steps)
            self.pulse_steps = self.goal_steps

    def _clip(self, steps: int) -> int:
        return min(max(steps, self.setup.min_steps), self.setup.max_steps)

    @property
    def top_speed_steps_s(self) -> float:
        """Return the present speed limit of its pulses, low while it enters its limits."""
        if self.entering:
            return entry_speed_steps_s(self.setup, HOBBY_STEPS_PER_TURN)
        return self.setup.max_speed_steps_s

    def adopt_pulse(self, pulse_steps: int) -> None:
        """Adopt the pulse of a channel that is not held; 0: none."""
        self.on = pulse_steps > 0
        if self.on:
            self._is_position_known = True
            self.goal_steps = self.pulse_steps = pulse_steps

    def start(self, pulse_steps: int, now_s: float) -> int:
        """Hold at the present pulse, or at the last position if there is none; return the goal."""
        self.goal_steps = self._clip(pulse_steps or round(self.pulse_steps))
        self.entering = pulse_steps not in (0, self.goal_steps)
        # A first pulse is not ramped, as there is no pulse to ramp from.
        self.pulse_steps = pulse_steps or self.goal_steps
        self.on, self._at_s = True, now_s
        return self.goal_steps

    def record_hold(self) -> None:
        """Record that it has pulses and follows goals."""
        self.on = self.held = self._is_position_known = True
        self.due = False

    def record_release(self, due: bool = False) -> None:
        """Record that it follows no goals any more; its pulses may continue."""
        self.held, self.due, self.entering = False, due, False

    def record_stop(self) -> None:
        """Record that it outputs no pulses: its servo has no torque, and is assumed not to move."""
        self.record_release()
        self.on, self.mean_steps_s = False, 0.0

    def advance(self, now_s: float) -> None:
        """Advance the estimate to ``now_s``."""
        spent_s = now_s - self._at_s
        if self.on and 0.0 < spent_s < inf:
            most = self.speed_steps_s * min(spent_s, self._longest_ramp_s)
            way = min(max(self.goal_steps - self.pulse_steps, -most), most)
            self.pulse_steps += way
            self.mean_steps_s = way / spent_s
        self._at_s = now_s

    def is_expected(self, pulse_steps: int) -> bool:
        """Return whether a pulse can be the commanded one."""
        if self._longest_ramp_s < inf:
            return pulse_steps > 0  # the next goals correct it
        room = FINE_STEPS + BEHIND_S * self.speed_steps_s
        return pulse_steps > 0 and abs(pulse_steps - self.pulse_steps) <= room

    def difference_text(self, pulse_steps: int) -> str:
        """Return how a pulse differs from the commanded one."""
        us, goal_us = pulse_steps / US_STEPS, self.goal_steps / US_STEPS
        return f"is sent to {goal_us:g} us and gets {us:g} us" if us else "has no pulses"
