"""A hobby servo: pulses in, a shaft that follows them, no feedback.

Widths and positions are quarter microseconds of the pulse that holds the shaft there. A servo
gets one pulse every 20 ms and moves in steps of 10 ms: towards the pulse at its top speed, with a
lag near the end, and not at all within its dead band. Without pulses it has no torque and
friction holds it. Inertia, load and noise are omitted.
"""

from collections.abc import Callable, Sequence
from math import exp
from typing import NamedTuple

STEP_S = 0.01


class HobbySpec(NamedTuple):
    """Specification of one servo and its channel.

    channel: its channel on the board
    start_steps: position of its shaft before the first pulse
    speed_steps_s: its own top speed; 22000 is 60 deg in 0.12 s, from data sheets of SG90
    lag_s: time constant near the end of a motion [A]
    dead_steps: dead band, 5 us from data sheets of MG90S
    stop_low_steps, stop_high_steps: hard stops of the shaft or of its joint
    min_steps, max_steps: the board clips targets of this channel to them; from the factory
        992..2000 us
    stall_torque_nm: torque that stalls it; only a world with physics uses it. 0.18 is
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
    """One servo and its joint.

    place_steps: position of its shaft; stuck: nothing moves it
    width_steps: the present pulses; 0: none
    """

    def __init__(self, spec: HobbySpec) -> None:
        self.spec = spec
        self.place_steps = self._clip_to_stops(self.spec.start_steps)
        self.stuck = False
        self.width_steps = 0
        self._share = 1.0 - exp(-STEP_S / self.spec.lag_s)

    def step(self) -> None:
        """Advance by 10 ms."""
        way = self.width_steps - self.place_steps
        if not (self.stuck or not self.width_steps or abs(way) <= self.spec.dead_steps):
            most = self.spec.speed_steps_s * STEP_S
            self.place_steps = self._clip_to_stops(
                self.place_steps + min(max(way * self._share, -most), most)
            )

    def jam(self, stuck: bool = True) -> None:
        """Jam it at its position, or free it."""
        self.stuck = stuck

    def turn(self, steps: float) -> None:
        """Turn it by hand, as far as its stops allow; a servo with pulses returns."""
        if not self.stuck:
            self.place_steps = self._clip_to_stops(self.place_steps + steps)

    def _clip_to_stops(self, steps: float) -> float:
        return min(max(steps, self.spec.stop_low_steps), self.spec.stop_high_steps)


HobbyMaker = Callable[[HobbySpec], HobbyServo]
"""Creates a servo from its specification."""


def build_servos(
    specs: Sequence[HobbySpec], channels: int, make: HobbyMaker = HobbyServo
) -> list[HobbyServo]:
    """Return one servo per channel of a board; channels without a spec have a default one.

    Raises:
        ValueError: a spec's channel does not exist or has two servos.
    """
    given = {spec.channel: spec for spec in specs}
    if len(given) < len(specs) or not set(given) <= set(range(channels)):
        raise ValueError(f"servos need different channels from 0 to {channels - 1}")
    return [make(given.get(channel, HobbySpec(channel))) for channel in range(channels)]
