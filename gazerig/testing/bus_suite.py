"""Test suite for every kind of servo bus.

A package runs it on its own bus with a short class:

    class TestMyBus(BusSuite):
        under_test = BusUnderTest("my-servo", 100, 900, 400.0, make, device)
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import nan
from typing import Any

import pytest

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import BusLost, ServoMissing
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import Feedback, ServoBus, ServoConfig
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.in_process_port import InProcessPort

_TICK_S = 0.01
_NAMES = ("eye", "jaw", "neck", "lid")
_IDS = (3, 1, 11, 7)
START = (0.4, 0.5, 0.65, 0.55)
"""Initial positions of the servos, as shares of their range."""
AWAY = (0.2, 0.8, 0.3, 0.7)
_NEAR_SHARE = 0.012
"""Largest distance from the goal due to friction and dead bands, as a share of the range."""


@dataclass(frozen=True)
class BusUnderTest:
    """One kind of bus and its emulated device with four servos.

    Attributes:
        model: model of its servos.
        low, high: their range in these tests, steps.
        speed_steps_s: their speed limit; the servos must be able to reach it.
        make: creates the bus from a port, configurations, and the seconds without any answer after
            which it gives up.
        device: creates the emulated device from the servos' initial steps by id, and a clock. It
            understands the commands of ``gazerig.sim_mock.faults``: ``status``, ``unplug``,
            ``plug``, ``lose``, ``clear`` and ``brown-out``.
        board: servos are channels of a board that does not measure their positions; faults affect
            the whole board.
        pulses_on: makes a board hold its servos before the test; receives the bench.
    """

    model: str
    low: int
    high: int
    speed_steps_s: float
    make: Callable[[BusPort, Sequence[ServoConfig], float], ServoBus]
    device: Callable[[Mapping[int, float], Callable[[], float]], Device]
    board: bool = False
    pulses_on: "Callable[[BusBench], None] | None" = None

    @cached_property
    def setups(self) -> tuple[ServoConfig, ...]:
        """Return the configurations of the servos."""
        rest = (self.low + self.high) // 2 if self.board else None
        return tuple(
            ServoConfig(
                servo_id, self.model, self.low, self.high, self.speed_steps_s, name, rest_steps=rest
            )
            for servo_id, name in zip(_IDS, _NAMES, strict=True)
        )

    @property
    def starts_steps(self) -> dict[int, float]:
        """Return the initial positions of the servos by id."""
        return {
            s.id: self.low + x * (self.high - self.low)
            for s, x in zip(self.setups, START, strict=True)
        }


@dataclass(frozen=True)
class BusBench:
    """The servos of one kind of bus, and actions of a test on them.

    Positions and goals are shares of each servo's range, 0..1 within its limits.

    Attributes:
        kind: the kind.
        port: the bus's port.
        now_s: clock.
        wait: waits for some seconds.
        command: runs a fault command.
    """

    kind: BusUnderTest
    port: BusPort
    now_s: Callable[[], float]
    wait: Callable[[float], None]
    command: Callable[[str], str]

    @property
    def setups(self) -> tuple[ServoConfig, ...]:
        """Return the configurations of the servos."""
        return self.kind.setups

    def bus(self, setups: Sequence[ServoConfig] = (), give_up_s: float = 60.0) -> ServoBus:
        """Create the bus."""
        return self.kind.make(self.port, setups or self.setups, give_up_s)

    def hold(self, setups: Sequence[ServoConfig] = (), give_up_s: float = 60.0) -> ServoBus:
        """Return a bus that holds every servo in its position."""
        if self.kind.pulses_on is not None:
            self.kind.pulses_on(self)
        bus = self.bus(setups, give_up_s)
        bus.open()
        bus.enable_torque()
        bus.events()
        return bus

    def steps(self, shares: Sequence[float]) -> list[int]:
        """Convert shares of the range to steps."""
        return [round(self.kind.low + x * (self.kind.high - self.kind.low)) for x in shares]

    def are_near(self, steps: Sequence[float], shares: Sequence[float]) -> bool:
        """Return whether all servos are near their goals."""
        most = _NEAR_SHARE * (self.kind.high - self.kind.low)
        return all(abs(a - b) <= most for a, b in zip(steps, self.steps(shares), strict=True))

    # --- the servos themselves, without the driver

    def _reports(self) -> list[dict[str, Any]]:
        servos = {one["id"]: one for one in json.loads(self.command("status"))["servos"]}
        return [servos[setup.id] for setup in self.setups]

    def true_steps(self) -> list[float]:
        """Return the true positions."""
        return [
            float(one["place"] if "place" in one else one["position"]) for one in self._reports()
        ]

    def true_goals_steps(self) -> list[int | None]:
        """Return the true goals, None for a servo without a goal."""
        return [one.get("target", one.get("goal")) or None for one in self._reports()]

    def holding(self) -> list[bool]:
        """Return which servos truly hold their position."""
        return [bool(one.get("target", one.get("torque"))) for one in self._reports()]

    def brown_out(self) -> None:
        """Restart the first servo, or the whole board."""
        self.command("brown-out" if self.kind.board else f"brown-out {self.setups[0].id}")

    # --- ticks

    def run(self, bus: ServoBus, seconds: float, goals: Sequence[float] = ()) -> Feedback:
        """Tick every 10 ms, with goals in shares; return the last feedback."""
        end_s = self.now_s() + seconds - 1e-9
        while True:
            feedback = bus.read(self.now_s())
            if goals:
                bus.write(self.steps(goals))
            if self.now_s() >= end_s:
                return feedback
            self.wait(_TICK_S)

    def run_until(
        self, bus: ServoBus, done: Callable[[Feedback], bool], goals: Sequence[float] = START
    ) -> Feedback:
        """Tick until a condition is true; return the feedback at that time."""
        end_s = self.now_s() + 8.0
        while self.now_s() < end_s:
            if done(feedback := self.run(bus, 0.0, goals)):
                return feedback
            self.wait(_TICK_S)
        raise AssertionError(f"not in 8 s: {feedback}, {bus.faults()}, {bus.events()}")

    def go(self, bus: ServoBus, goals: Sequence[float]) -> None:
        """Move the servos to goals, and check that they truly get there."""
        self.run_until(bus, lambda f: self.are_near(f.position_steps, goals), goals)
        self.run(bus, 0.3, goals)
        assert self.are_near(self.true_steps(), goals)


def create_bench(kind: BusUnderTest) -> BusBench:
    """Return a bench in this process, on a clock that advances only by waiting."""
    now = [50.0]

    def sleep_until(t_s: float) -> None:
        now[0] = max(now[0], t_s)

    device = kind.device(kind.starts_steps, lambda: now[0])
    port = InProcessPort(device, None, "the port under test", sleep_until)
    return BusBench(
        kind, port, lambda: now[0], lambda s: sleep_until(now[0] + s), device.faults.command
    )


def _are_healthy(feedback: Feedback) -> bool:
    """Return whether all servos have answered with their torque on."""
    return not feedback.missing and all(feedback.torque)


class BusSuite:
    """Opening, holding, following, limits, release; and what is lost and comes back.

    under_test: the kind of bus
    """

    under_test: BusUnderTest | None = None

    @pytest.fixture
    def bench(self) -> BusBench:
        """Return the bench in this process."""
        assert self.under_test is not None, "set under_test, or define your own fixture bench"
        return create_bench(self.under_test)

    @pytest.fixture
    def bus(self, bench: BusBench) -> Iterator[ServoBus]:
        """Return the bus, which holds every servo in its position."""
        bus = bench.hold()
        yield bus
        bus.disable_torque()
        bus.close()

    # --- open, torque on, read, write, release

    def test_nothing_moves_before_the_torque_is_on(self, bench):
        bus = bench.bus()
        bus.open()
        assert not any(bus.read(bench.now_s()).torque)
        bench.run(bus, 0.1, AWAY)
        assert bench.are_near(bench.true_steps(), START)
        bus.close()
        bus.close()
        bus.open()  # again
        bus.close()

    def test_torque_on_holds_every_servo_where_it_is_until_its_release(self, bench, bus):
        for _ in range(10):
            feedback = bench.run(bus, 0.02)
            assert bench.are_near(bench.true_steps(), START)
        assert _are_healthy(feedback) and all(bench.holding())
        bus.disable_torque()
        assert not any(bench.holding())
        feedback = bench.run(bus, 0.1, AWAY)
        assert not any(feedback.torque) and bench.are_near(bench.true_steps(), START)

    def test_goals_are_followed_and_told(self, bench, bus):
        bench.go(bus, AWAY)
        before_s, health = bench.now_s(), bus.health()
        feedback = bench.run(bus, 0.0, AWAY)
        assert _are_healthy(feedback) and bench.are_near(feedback.position_steps, AWAY)
        assert all(before_s <= at_s <= bench.now_s() for at_s in feedback.at_s)
        assert not any((*feedback.fault, *feedback.rearmed)) and bus.faults() == ()
        assert health.errors == {} and bus.health().tx_bytes > health.tx_bytes > 0

    def test_goals_are_clipped_to_the_limits(self, bench, bus):
        bench.run(bus, 2.0, (-40.0, 60.0, -1e-3, 1.001))
        assert bench.are_near(bench.true_steps(), (0.0, 1.0, 0.0, 1.0))
        low, high = bench.kind.low, bench.kind.high
        assert all(low <= goal <= high for goal in bench.true_goals_steps())

    def test_what_is_no_number_is_refused_and_nothing_is_sent(self, bench, bus):
        bench.run(bus, 0.05, START)
        before = bus.health().tx_bytes
        *goals, _ = bench.steps(AWAY)
        with pytest.raises(ValueError, match="not a number"):
            bus.write([*goals, nan])
        with pytest.raises(ValueError):
            bus.write(goals)
        assert bus.health().tx_bytes == before

    # --- absent servos and ports

    def test_open_names_the_servo_that_is_missing(self, bench):
        if bench.kind.board:
            return
        *others, last = bench.setups
        with pytest.raises(ServoMissing, match=f"{last.name} .*99. does not answer") as caught:
            bench.bus([*others, last._replace(id=99)]).open()
        assert bench.port.port_name in str(caught.value) and "\n" not in str(caught.value)
        bus = bench.bus()
        bus.open()  # the port is free
        bus.close()

    def test_one_silent_servo_costs_only_itself(self, bench, bus):
        if bench.kind.board:
            return
        bench.command(f"lose {bench.setups[0].id}")
        bench.run_until(bus, lambda f: f.missing == (0,))
        for _ in range(20):
            assert bench.run(bus, 0.01, START).missing == (0,)
        bench.run(bus, 2.0, START)
        told = bus.events()
        assert any(servo_label(bench.setups[0]) in line for line in told), told
        bench.command("clear")
        bench.run_until(bus, _are_healthy)
        assert bench.are_near(bench.true_steps(), START)

    # --- a lost port, a restart

    def test_an_unplugged_port_comes_back_and_holds(self, bench, bus):
        bench.run(bus, 0.1, START)
        bench.command("unplug")
        bench.run_until(bus, lambda f: len(f.missing) == len(bench.setups))
        bench.run(bus, 0.2, AWAY)  # a planner continues for a while
        bench.command("plug")
        self.recover(bench, bus, range(len(bench.setups)))
        told = bus.events()
        assert any(line.startswith("port lost: ") for line in told)
        assert any(line.startswith("port back after ") for line in told)

    def test_a_port_that_stays_away_is_given_up_and_told_at_release(self, bench):
        bus = bench.hold(give_up_s=1.0)
        bench.command("unplug")
        with pytest.raises(BusLost, match="has been gone for 1.[012] s"):
            bench.run(bus, 3.0, START)
        with pytest.raises(BusLost, match="is gone.*cut the servo power"):
            bus.disable_torque()
        bench.command("plug")
        bus.disable_torque()
        assert not any(bench.holding())
        bus.close()

    def test_a_servo_that_restarts_is_held_where_it_is(self, bench, bus):
        bench.run(bus, 0.2, START)
        bench.brown_out()
        self.recover(bench, bus, range(len(START)) if bench.kind.board else (0,))
        assert all(bench.holding()) and bus.faults() == ()
        assert any("restarted: set up again" in line for line in bus.events())
        bench.go(bus, AWAY)

    @pytest.mark.parametrize("restarts", [False, True])
    def test_no_servo_is_faster_than_it_was_set_up(self, bench, restarts):
        """Only the limit of the servo or its board restrains a goal that is suddenly far away."""
        slow = [s._replace(max_speed_steps_s=0.2 * s.max_speed_steps_s) for s in bench.setups]
        bus = bench.hold(slow)
        bench.run(bus, 0.3, START)
        if restarts:
            bench.brown_out()
            bench.run_until(bus, lambda f: bool(f.missing or any(f.rearmed)))
            bench.run_until(bus, _are_healthy)
        before_s, before = bench.now_s(), bench.true_steps()
        for _ in range(30):
            bench.run(bus, 0.0, [0.95] * 4)
            bench.wait(0.02)
            now_s, now = bench.now_s(), bench.true_steps()
            most = 1.2 * slow[0].max_speed_steps_s * (now_s - before_s) + 12.0
            assert all(abs(b - a) <= most for a, b in zip(before, now, strict=True))
            before_s, before = now_s, now
        bench.go(bus, [0.95] * 4)

    def recover(self, bench: BusBench, bus: ServoBus, gone: Sequence[int]) -> None:
        """Tick until all hold again, with distant goals until a servo reports its position.

        No servo that was gone may move until then.
        """
        goals: list[float] = [0.9 if p in gone else START[p] for p in range(len(START))]
        rearmed: set[int] = set()
        end_s = bench.now_s() + 8.0
        while True:
            feedback = bus.read(bench.now_s())
            for place in [p for p, again in enumerate(feedback.rearmed) if again]:
                rearmed.add(place)
                goals[place] = START[place]
            true = bench.true_steps()
            assert bench.are_near([true[p] for p in gone], [START[p] for p in gone])
            if rearmed == set(gone) and _are_healthy(feedback):
                break
            assert bench.now_s() < end_s, (rearmed, bus.events())
            bus.write(bench.steps(goals))
            bench.wait(_TICK_S)
        bench.run(bus, 0.3, goals)
        assert bench.are_near(bench.true_steps(), START)
