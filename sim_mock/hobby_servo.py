"""A hobby servo: pulses in, a shaft that follows them, no feedback.

Widths and places are quarter microseconds of the pulse that would hold the shaft there.
A servo gets one pulse every 20 ms and moves in steps of 10 ms: towards the pulse as fast
as it can, with a lag near the end, and not at all within its dead band. Without pulses it
has no torque and stays where friction leaves it. Inertia, load and noise are left out.
"""

from collections.abc import Callable, Sequence
from math import exp
from typing import NamedTuple

STEP_S = 0.01


class HobbySpec(NamedTuple):
    """How to build one servo, and what its channel lets through to it.

    channel: its channel on the board
    start_steps: where its shaft is before the first pulse
    speed_steps_s: its own top speed; 22000 is 60 deg in 0.12 s, from data sheets of SG90
    lag_s: time constant of the last bit of the way [A]
    dead_steps: it does not move for less, 5 us from data sheets of MG90S
    stop_low_steps, stop_high_steps: hard stops of the shaft or of what it moves
    min_steps, max_steps: the board clips targets of this channel so; from the factory
        992..2000 us
    stall_torque_nm: torque that holds it still; only a world with physics asks for it. 0.18 is
        1.8 kg cm, from data sheets of SG90 and MG90S
    """

    channel: int
    start_steps: float = 6000.0
    speed_steps_s: float = 22_000.0
    lag_s: float = 0.03
    dead_steps: float = 20.0
    stop_low_steps: float = 2000.0
    stop_high_steps: float = 10_000.0
    min_steps: int = 992 * 4
    max_steps: int = 2000 * 4
    stall_torque_nm: float = 0.18


class HobbyServo:
    """One servo and the joint it moves.

    place_steps: where its shaft is; stuck: nothing moves it
    width_steps: the pulses that come; 0: none do
    """

    def __init__(self, spec: HobbySpec | Sequence[float]) -> None:
        self.spec = checked(HobbySpec(*spec))
        self.place_steps = self._within(self.spec.start_steps)
        self.stuck = False
        self.width_steps = 0
        self._share = 1.0 - exp(-STEP_S / self.spec.lag_s) if self.spec.lag_s > 0.0 else 1.0

    @property
    def unpowered(self) -> bool:
        """Return whether no pulses come: a hand can turn it."""
        return self.width_steps == 0

    @property
    def resting(self) -> bool:
        """Return whether it would not move in the next step."""
        return self.place_steps == self._next_steps()

    @property
    def straining(self) -> bool:
        """Return whether it pushes against an obstacle."""
        return not self._content() and self.resting

    def step(self) -> None:
        """Let 10 ms pass."""
        self.place_steps = self._next_steps()

    def turn(self, steps: float) -> None:
        """Turn it by hand, as far as its stops allow; one with pulses goes back by itself.

        Raises:
            ValueError: it is stuck.
        """
        if self.stuck:
            raise ValueError(f"channel {self.spec.channel} is stuck; free it first")
        self.place_steps = self._within(self.place_steps + steps)

    def _content(self) -> bool:
        return self.unpowered or abs(self.width_steps - self.place_steps) <= self.spec.dead_steps

    def _next_steps(self) -> float:
        if self.stuck or self._content():
            return self.place_steps
        most = self.spec.speed_steps_s * STEP_S
        move = (self.width_steps - self.place_steps) * self._share
        return self._within(self.place_steps + min(max(move, -most), most))

    def _within(self, steps: float) -> float:
        return min(max(steps, self.spec.stop_low_steps), self.spec.stop_high_steps)


def checked(spec: HobbySpec) -> HobbySpec:
    """Return the spec if such a servo can exist.

    Raises:
        ValueError: a number is out of its range, named with the range.
    """
    for name, (low, high) in _RANGES.items():
        value = getattr(spec, name)
        if not low <= value <= high:
            raise ValueError(f"servo on channel {spec.channel}: {name} is not in {low}..{high}")
    for low_name, high_name in (
        ("stop_low_steps", "stop_high_steps"),
        ("min_steps", "max_steps"),
    ):
        if not getattr(spec, low_name) <= getattr(spec, high_name):
            raise ValueError(f"servo on channel {spec.channel}: {low_name} is above {high_name}")
    return spec


HobbyMaker = Callable[[HobbySpec], HobbyServo]
"""Makes a servo of its specification."""


def build_servos(
    specs: Sequence[HobbySpec | Sequence[float]], channels: int, make: HobbyMaker = HobbyServo
) -> list[HobbyServo]:
    """Return one servo per channel of a board; channels without a spec have a default one.

    Raises:
        ValueError: a spec's channel does not exist or has two of them.
    """
    given: dict[int, HobbySpec] = {}
    for spec in specs:
        channel = int(spec[0])
        if channel in given:
            raise ValueError(
                f"two servos are on channel {channel}: give each a channel of its own, "
                f"0 to {channels - 1}"
            )
        if not 0 <= channel < channels:
            raise ValueError(f"servo on channel {channel}: there is 0 to {channels - 1}")
        given[channel] = HobbySpec(*spec)
    return [make(given.get(channel, HobbySpec(channel))) for channel in range(channels)]


_RANGES: dict[str, tuple[float, float]] = {
    "channel": (0, 255),
    "start_steps": (0.0, 16_383.0),
    "speed_steps_s": (100.0, 1e6),
    "lag_s": (0.0, 1.0),
    "dead_steps": (0.0, 400.0),
    "stop_low_steps": (0.0, 16_383.0),
    "stop_high_steps": (0.0, 16_383.0),
    "min_steps": (256, 13_120),
    "max_steps": (256, 13_120),
    "stall_torque_nm": (0.01, 10.0),
}
"""What a Maestro can be set to send: 64..3280 us, user's guide, section 4.b."""
