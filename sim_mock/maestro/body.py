"""An emulated Maestro without its serial side: channels, servos, errors, a script, and time.

It moves in whole periods of 10 ms and sends pulses every 20 ms, however often it is read. Widths
are quarter microseconds. A channel's output changes every 10 ms, by at most the speed limit
(quarter microseconds per 10 ms). The speed changes by at most the acceleration limit (the same per
80 ms), so that it comes to rest at the target. Sums are stored in eighths, in which both limits are
integers. Source: Pololu Maestro User's Guide (0J40), sections 4.b and 5.e. Its braking is not
documented; assumed: as late as possible [A].
"""

from collections.abc import Callable, Sequence
from math import isqrt

from gazerig.sim_mock.hobby_servo import HobbyServo
from gazerig.sim_mock.maestro.commands import ERRORS
from gazerig.sim_mock.maestro.settings import OnError, Settings

EIGHTHS = 8
"""Periods of 10 ms in the 80 ms of the unit of acceleration."""


class EmulatedChannel:
    """A channel configured as a servo.

    target, position: commanded width and present width; 0: no pulses
    speed, acceleration: limits in the board's units; 0: unlimited
    low, high: targets are clipped to these
    """

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high
        self.target = 0
        self.speed = self.acceleration = 0
        self._at8 = self._velocity8 = 0

    @property
    def position(self) -> int:
        """Return the present width; 0: no pulses."""
        return self._at8 // EIGHTHS

    @property
    def is_limited(self) -> bool:
        """Return whether it has a limit of speed or acceleration."""
        return self.speed != 0 or self.acceleration != 0

    @property
    def is_moving(self) -> bool:
        """Return whether it has not reached its target."""
        return self._at8 != self.target * EIGHTHS or self._velocity8 != 0

    @property
    def is_moving_under_limit(self) -> bool:
        """Return whether it moves under a limit, which the board reports as moving."""
        return self.is_limited and self.is_moving

    def limit_speed(self, speed: int) -> None:
        """Limit the speed; 0: unlimited."""
        self.speed = speed

    def limit_acceleration(self, acceleration: int) -> None:
        """Limit the acceleration; 0: unlimited. Values above 255 count as 255 [A]."""
        self.acceleration = min(acceleration, 255)

    def set_target(self, steps: int) -> None:
        """Set the target, clipped to the limits; 0 ends the pulses.

        Without limits, or without pulses before, the output changes immediately: the board does not
        know the servo's position.
        """
        self.target = min(max(steps, self.low), self.high) if steps else 0
        if not steps or not self._at8 or not self.is_limited:
            self._jump_to_target()

    def limit(self, low: int, high: int) -> None:
        """Change the limits of targets."""
        self.low, self.high = low, high
        if self.target:
            self.target = min(max(self.target, low), high)
            self._at8 = min(max(self._at8, low * EIGHTHS), high * EIGHTHS)

    def restart(self, speed: int = 0, acceleration: int = 0) -> None:
        """Reset to power-on: no pulses, the configured limits of speed and acceleration."""
        self.speed, self.acceleration = speed, acceleration
        self.set_target(0)

    def step(self) -> None:
        """Advance by 10 ms."""
        if not self.is_moving:
            return
        if not self.is_limited:
            self._jump_to_target()
            return
        way8 = self.target * EIGHTHS - self._at8
        sign = -1 if way8 < 0 else 1
        # The speed towards the target for the next 10 ms; below 0: still away from it.
        speed8, most8 = sign * self._velocity8, self.speed * EIGHTHS or abs(way8)
        if self.acceleration:
            wanted8 = min(most8, largest_braking_step(abs(way8), self.acceleration))
            speed8 = min(max(wanted8, speed8 - self.acceleration), speed8 + self.acceleration)
        else:
            speed8 = min(most8, abs(way8))
        velocity8 = sign * speed8
        at8 = self._at8 + velocity8
        self._at8 = min(max(at8, self.low * EIGHTHS), self.high * EIGHTHS)
        clipped = self._at8 != at8
        there = self._at8 == self.target * EIGHTHS and abs(velocity8) <= self.acceleration
        self._velocity8 = 0 if clipped or there or not self.acceleration else velocity8

    def _jump_to_target(self) -> None:
        self._at8, self._velocity8 = self.target * EIGHTHS, 0


def largest_braking_step(way: int, acceleration: int) -> int:
    """Return the largest first step of a motion that comes to rest within a distance.

    Each further step is smaller by the acceleration; the last one is the smallest.
    """
    steps = (isqrt(1 + 8 * way // acceleration) - 1) // 2
    rest = way - acceleration * steps * (steps + 1) // 2
    return steps * acceleration + rest // (steps + 1)


PERIODS_S = 100
"""Periods per second; every second one has a pulse."""
RESTART_S = 0.1
"""Time from a dip of the supply until it receives again [A]."""
PAUSE = 1000
"""Periods without access after which they are not simulated one by one."""
SWING = 100
"""Periods after which the script of a fault sends a channel to its other end."""


class MaestroBody:
    """The board's body and its servos.

    Args:
        servos: one for each channel, in their order.
        settings: its configuration over USB.

    errors: its error register; servo_power: whether the servos have their supply
    script_running: whether a script runs; swung: the channel that it moves, None without one
    """

    def __init__(
        self, servos: Sequence[HobbyServo], now_s: Callable[[], float], settings: Settings
    ) -> None:
        self.now_s = now_s
        self.servos = tuple(servos)
        self.channels = tuple(EmulatedChannel(s.spec.min_steps, s.spec.max_steps) for s in servos)
        self.settings = settings
        self.errors = 0
        self.servo_power = True
        self.script_running = False
        self.script_channel: int | None = None
        self._period = self._fed = self._awake_from = whole_periods(now_s())
        self._timed_out = False
        self.move_all_to(settings.startup)

    @property
    def is_awake(self) -> bool:
        """Return whether it is not in a restart."""
        return self._period >= self._awake_from

    # --- commands

    def move_all_to(self, where: OnError) -> None:
        """Send every channel to its configured position at start or on an error."""
        if where != "ignore":
            for channel in self.channels:
                channel.set_target(self.settings.home_steps if where == "home" else 0)

    def reset_timeout(self) -> None:
        """Restart the timeout, because a valid command has arrived."""
        self._fed, self._timed_out = self._period, False

    def limit(self, low: int | None, high: int | None) -> None:
        """Set the limits of every channel's targets; None: no change.

        Raises:
            ValueError: the lower limit would be above the upper one.
        """
        wanted = [
            (c.low if low is None else low, c.high if high is None else high) for c in self.channels
        ]
        for lowest, highest in wanted:
            if lowest > highest:
                raise ValueError(f"min-us {lowest / 4:g} would be above max-us {highest / 4:g}")
        for channel, limits in zip(self.channels, wanted, strict=True):
            channel.limit(*limits)

    # --- errors

    def fail(self, error: str) -> None:
        """Register an error by its name; every channel reacts as configured."""
        self.errors |= 1 << ERRORS.index(error)
        self.move_all_to(self.settings.on_error)

    def read_errors(self) -> int:
        """Return the error register and clear it."""
        errors, self.errors = self.errors, 0
        return errors

    def restart(self) -> None:
        """Restart as after a dip of the supply, with an empty error register."""
        self.advance()
        self.errors = 0
        self.stop_script()
        for channel in self.channels:
            channel.restart(self.settings.speed, self.settings.acceleration)
        self._awake_from = self._period + round(RESTART_S * PERIODS_S)

    # --- scripts

    def run_script(self, channel: int | None = None) -> None:
        """Start an endless script that swings a channel from end to end, or does nothing."""
        self.advance()
        self.script_running, self.script_channel = True, channel

    def stop_script(self) -> None:
        """End the script."""
        self.script_running, self.script_channel = False, None

    # --- time

    def advance(self) -> None:
        """Advance to the present time."""
        now = whole_periods(self.now_s())
        while now - self._period > PAUSE and self.script_channel is not None:
            self._run_periods(self._period + 2 * SWING)
            due = self._timeout_period()
            until = now if due is None else min(now, due - 1)
            if (
                self.is_awake
                and until > self._period
                and self._are_at_rest(but=self.script_channel)
            ):
                self._period += (until - self._period) // (2 * SWING) * (2 * SWING)
        self._run_periods(now)

    def _run_periods(self, until: int) -> None:
        while self._period < until:
            following = self._period + 1
            if self.script_channel is None and self.is_awake and self._are_at_rest():
                # The next event is the end of the serial time-out, or none.
                due = self._timeout_period()
                following = until if due is None else max(following, min(until, due))
            self._period = following
            self._run_period()

    def _timeout_period(self) -> int | None:
        """Return the period in which the serial time-out ends, None: never."""
        if not self.settings.timeout_s or self._timed_out:
            return None
        return self._fed + round(self.settings.timeout_s * PERIODS_S)

    def _are_at_rest(self, but: int | None = None) -> bool:
        """Return whether every servo except ``but`` has followed its last pulse."""
        return all(
            not channel.is_moving and servo.width_steps == self._pulse(channel) and servo.is_resting
            for k, (channel, servo) in enumerate(zip(self.channels, self.servos, strict=True))
            if k != but
        )

    def _pulse(self, channel: EmulatedChannel) -> int:
        """Return the pulse that reaches a servo; 0: none."""
        return channel.position if self.servo_power else 0

    def _run_period(self) -> None:
        """Advance by one period."""
        if self._period == self._awake_from:
            self.reset_timeout()
            self.move_all_to(self.settings.startup)
        due = self._timeout_period()
        if due is not None and self.is_awake and self._period >= due:
            self._timed_out = True
            self.fail("timeout")
        if self.script_channel is not None and self._period % SWING == 0:
            channel = self.channels[self.script_channel]
            channel.set_target(channel.low if self._period // SWING % 2 else channel.high)
        for servo, channel in zip(self.servos, self.channels, strict=True):
            channel.step()
            if self._period % 2 == 0:
                servo.width_steps = self._pulse(channel)
            servo.step()


def whole_periods(now_s: float) -> int:
    """Return the whole periods of a time; the margin keeps 0.03 s from being two of them."""
    return int(now_s * PERIODS_S + 1e-3)
