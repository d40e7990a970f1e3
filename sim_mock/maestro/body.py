"""An emulated Maestro without its serial side: channels, servos, errors, a script, and time.

It moves in whole periods of 10 ms and sends pulses every 20 ms, however often it is read.
Source: Pololu Maestro User's Guide (0J40); [A] is assumed.
"""

from collections.abc import Callable, Sequence

from gazerig.sim_mock.hobby_servo import HobbyServo
from gazerig.sim_mock.maestro.channel import EmulatedChannel
from gazerig.sim_mock.maestro.commands import ERRORS
from gazerig.sim_mock.maestro.settings import OnError, Settings

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
        self.send_all(settings.startup)

    @property
    def awake(self) -> bool:
        """Return whether it is not in a restart."""
        return self._period >= self._awake_from

    # --- commands

    def send_all(self, where: OnError) -> None:
        """Send every channel to its configured position at start or on an error."""
        if where != "ignore":
            for channel in self.channels:
                channel.aim(self.settings.home_steps if where == "home" else 0)

    def feed(self) -> None:
        """Restart the time without valid commands."""
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
        self.send_all(self.settings.on_error)

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
            due = self._due()
            until = now if due is None else min(now, due - 1)
            if self.awake and until > self._period and self._at_rest(but=self.script_channel):
                self._period += (until - self._period) // (2 * SWING) * (2 * SWING)
        self._run_periods(now)

    def _run_periods(self, until: int) -> None:
        while self._period < until:
            self._period = self._next_period(until)
            self._pass()

    def _next_period(self, now: int) -> int:
        """Return the next period with an event."""
        if self.script_channel is not None or not self.awake or not self._at_rest():
            return self._period + 1
        due = self._due()
        return now if due is None else max(self._period + 1, min(now, due))

    def _due(self) -> int | None:
        """Return the period in which the serial time-out ends, None: never."""
        if not self.settings.timeout_s or self._timed_out:
            return None
        return self._fed + round(self.settings.timeout_s * PERIODS_S)

    def _at_rest(self, but: int | None = None) -> bool:
        """Return whether every servo except ``but`` has followed its last pulse."""
        return all(
            not channel.moving and servo.width_steps == self._pulse(channel) and servo.resting
            for k, (channel, servo) in enumerate(zip(self.channels, self.servos, strict=True))
            if k != but
        )

    def _pulse(self, channel: EmulatedChannel) -> int:
        """Return the pulse that reaches a servo; 0: none."""
        return channel.position if self.servo_power else 0

    def _pass(self) -> None:
        """Advance by one period."""
        if self._period == self._awake_from:
            self.feed()
            self.send_all(self.settings.startup)
        due = self._due()
        if due is not None and self.awake and self._period >= due:
            self._timed_out = True
            self.fail("timeout")
        if self.script_channel is not None and self._period % SWING == 0:
            channel = self.channels[self.script_channel]
            channel.aim(channel.low if self._period // SWING % 2 else channel.high)
        for servo, channel in zip(self.servos, self.channels, strict=True):
            channel.step()
            if self._period % 2 == 0:
                servo.width_steps = self._pulse(channel)
            servo.step()


def whole_periods(now_s: float) -> int:
    """Return the whole periods of a time; the margin keeps 0.03 s from being two of them."""
    return int(now_s * PERIODS_S + 1e-3)
