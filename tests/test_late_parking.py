"""Every shipped rig parks in time on a host whose ticks come late, without haste."""

import random
from collections.abc import Callable
from itertools import pairwise
from math import copysign, radians

import pytest

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import PARK_S, run
from gazerig.robot.model.clock import Clock
from gazerig.robot.safety.guard import SOFT_START_RAD_S2

Missed = Callable[[int, random.Random], int]
HOSTS: dict[str, Missed] = {
    "one to three slots": lambda _, rng: rng.choice((1, 2, 3)),
    "three slots": lambda _n, _rng: 3,
    "never four times": lambda n, rng: rng.choice((1, 2, 3)) if n % 4 else 0,
}


class LateClock:
    """A simulated clock on which waits take some slots longer than requested."""

    def __init__(self, clock: Clock, missed: Missed, period_s: float) -> None:
        self._clock, self._missed, self._period_s = clock, missed, period_s
        self._rng, self._waits = random.Random(3), 0
        self.now_s = clock.now_s

    def sleep_until(self, t_s: float) -> None:
        late_s = self._missed(self._waits, self._rng) * self._period_s
        self._clock.sleep_until(max(t_s, self.now_s()) + late_s)
        self._waits += 1


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("name", ["desk", "maker"])
def test_it_parks_in_time_on_a_host_that_is_late(name: str, host: str) -> None:
    rig = load_rig(name)
    made = assemble(rig, RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
    robot, period_s = made.robot, 1.0 / made.loop.rate_hz
    limits = robot._guard.limits
    robot.start(made.clock)
    run(robot, made.clock, made.loop, lambda s: "over" if s >= 0.5 else None, lambda _: None)
    sent: list[tuple[float, tuple[float, ...]]] = []
    write = robot.body.write

    def watched(command_rad: tuple[float, ...]) -> None:
        sent.append((made.clock.now_s(), command_rad))
        write(command_rad)

    robot.body.write = watched  # type: ignore[method-assign]
    start_s, clock = made.clock.now_s(), LateClock(made.clock, HOSTS[host], period_s)
    assert robot.park(made.park_rad, clock, made.loop)
    assert made.clock.now_s() - start_s <= PARK_S
    robot.stop()
    made.close()

    slow = radians(rig.guard.soft_start_speed_deg_s)
    soft = SOFT_START_RAD_S2
    times = [t_s for t_s, _ in sent]
    for i, (limit, park_rad) in enumerate(zip(limits, made.park_rad, strict=True)):
        angles = [command_rad[i] for _, command_rad in sent]
        assert all(limit.low_rad - 1e-9 <= angle <= limit.high_rad + 1e-9 for angle in angles)
        # The last degree is no slow passage: the joint has met its goal.
        far = [k for k in range(1, len(sent)) if abs(angles[k - 1] - park_rad) > radians(1.0)]
        step = [0.0, *(now - before for before, now in pairwise(angles))]
        gap_s = [0.0, *(now - before for before, now in pairwise(times))]
        for k in far[1:]:  # no farther than the slow speed reaches in the passed time
            last = abs(step[k - 1]) / gap_s[k - 1]
            assert abs(step[k]) / gap_s[k] <= max(slow, last) + 1e-6
        if host != "never four times":
            continue
        # One tick in four comes in time: each moves joints for one slot, from what is left of
        # their speed. That is regained with the joint's own acceleration, and no more than that.
        speed = [one / period_s for one in step]
        fastest = abs(speed[1])
        for k in far[1:]:
            lost = limit.accel_rad_s2 * (gap_s[k] - period_s)
            left = copysign(max(0.0, abs(speed[k - 1]) - lost), speed[k - 1])
            assert abs(speed[k] - left) <= limit.accel_rad_s2 * period_s + 1e-6
            assert abs(speed[k]) <= max(abs(left), min(slow, fastest + soft * period_s)) + 1e-6
            fastest = max(fastest, abs(speed[k]))
