"""Test suite for every kind of servo bus.

A package runs it on its own bus with a short class:

    class TestMyBus(BusSuite):
        under_test = BusUnderTest("mine", "my-servo", 100, 900, 400.0, make, device)
"""

from collections.abc import Callable, Iterator
from math import nan

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.types import ServoBus
from gazerig.testing.bus_bench import (
    PLACES,
    BusBench,
    BusUnderTest,
    InProcessBench,
    are_healthy,
    create_in_process_bench,
    held_bus,
    present,
    rows,
)

ANY = st.integers(-(2**40), 2**40) | st.floats(allow_nan=True, allow_infinity=True)
FAULTS = ("", "lose all count 2", "delay all 15 count 3", "corrupt all count 3", "unplug for 0.05")


class BusBenches:
    """The benches on which the suites run; gazerig tests several, a package tests one.

    under_test: the kind of bus
    """

    under_test: BusUnderTest | None = None

    @pytest.fixture
    def another(self) -> Callable[[], InProcessBench]:
        """Return a function that creates another bench in this process."""
        kind = self.under_test
        assert kind is not None, "set under_test, or define your own fixture another"
        return lambda: create_in_process_bench({kind.name: kind}, {kind.name: PLACES})

    @pytest.fixture
    def here(self, another: Callable[[], InProcessBench]) -> BusBench:
        """Return a bench in this process: for long tests, and for tests that need no terminal."""
        return another().bench

    @pytest.fixture
    def twin(self, here: BusBench) -> BusBench:
        """Return each available bench: in this process, or behind a terminal."""
        return here

    @pytest.fixture
    def held(self, twin: BusBench) -> Iterator[ServoBus]:
        """Return the bus of ``twin``, which holds every servo in its position."""
        yield from held_bus(twin)

    @pytest.fixture
    def held_here(self, here: BusBench) -> Iterator[ServoBus]:
        """Return the bus of ``here``, which holds every servo in its position."""
        yield from held_bus(here)


class BusSuite(BusBenches):
    """Opening, holding, following, limits, invalid goals and release."""

    # --- open, engage, read, write, release

    def test_open_finds_all_and_nothing_moves(self, twin):
        twin.pulses_on()
        bus = twin.bus()
        before = twin.true_shares()
        bus.open()
        readings = rows(bus.read(twin.now_s()))
        assert twin.are_near(twin.measured_shares(readings), twin.start_shares())
        # A Maestro that already sends pulses continues; no other servo holds its position.
        assert [present(r).torque for r in readings] == [
            twin.is_board(p) for p in range(twin.count)
        ]
        bus.write(twin.steps(twin.away_shares()))
        twin.run(bus, 0.1, twin.away_shares())
        assert twin.are_near(twin.true_shares(), before)
        bus.close()

    def test_readings_are_fresh_in_order_and_say_whether_they_are_measured(self, here, held_here):
        here.run(held_here, 0.05)
        before_s = here.now_s()
        readings = rows(held_here.read(before_s))
        assert here.are_near(here.measured_shares(readings), here.start_shares())
        assert all(before_s <= present(r).at_s <= here.now_s() for r in readings)
        assert [present(r).measured for r in readings] == [
            not here.is_board(p) for p in range(here.count)
        ]
        assert not any(present(r).fault or present(r).rearmed for r in readings)

    def test_engage_holds_every_servo_where_it_is(self, here):
        here.pulses_on()
        bus = here.bus()
        bus.open()
        before = here.true_shares()
        goals = bus.enable_torque()
        assert here.are_near(here.shares(goals), before)
        for _ in range(10):
            readings = here.run(bus, 0.02)
            assert here.are_near(here.true_shares(), before)
        assert are_healthy(readings)
        assert here.holding() == [True] * here.count
        bus.disable_torque()
        bus.close()

    def test_who_cannot_tell_his_place_goes_to_his_rest_and_that_is_said(self, here):
        bus = here.bus()
        bus.open()
        before = here.true_shares()
        bus.enable_torque()
        hobby = [here.is_board(p) for p in range(here.count)]
        wanted = [0.5 if one else at for one, at in zip(hobby, before, strict=True)]
        here.run(bus, 0.3, wanted)
        assert here.are_near(here.true_shares(), wanted)
        told = bus.events()
        limp = [
            line for line in told if "had no pulses: they move to their goals immediately" in line
        ]
        assert len(limp) == any(hobby)
        for place, setup in enumerate(here.setups):
            assert not any(hobby) or hobby[place] == (servo_label(setup) in limp[0])
        bus.disable_torque()
        bus.close()

    def test_goals_are_followed_and_told(self, twin, held):
        readings = twin.run_until(
            held,
            lambda r: twin.are_near(twin.measured_shares(r), twin.away_shares()),
            twin.away_shares(),
            timeout_s=5.0,
        )
        twin.run(held, 0.3, twin.away_shares())
        assert twin.are_near(twin.true_shares(), twin.away_shares())
        assert are_healthy(readings)

    def test_goals_are_clipped_to_the_limits(self, here, held_here):
        ends = [(-40.0, 60.0, -1e-3, 1.001)[place % 4] for place in range(here.count)]
        inside = [min(1.0, max(0.0, end)) for end in ends]
        here.run_until(
            held_here, lambda r: here.are_near(here.measured_shares(r), inside), ends, timeout_s=5.0
        )
        here.run(held_here, 0.3, ends)
        assert here.are_near(here.true_shares(), inside)
        for place, (goal, wanted) in enumerate(
            zip(here.true_goals_steps(), here.steps(inside), strict=True)
        ):
            assert abs(goal - wanted) <= here.kinds[here.on[place]].grain_steps

    def test_what_is_no_number_is_refused_and_nothing_is_sent(self, here, held_here):
        here.run(held_here, 0.05, here.start_shares())
        before = held_here.health().tx_bytes
        for place in range(here.count):
            goals = here.steps(here.away_shares())
            goals[place] = nan
            with pytest.raises(ValueError, match="not a number"):
                held_here.write(goals)
        for wrong in (goals[:-1], [*goals, goals[0]]):
            with pytest.raises(ValueError):
                held_here.write(wrong)
        assert held_here.health().tx_bytes == before
        here.run(held_here, 0.2)
        assert here.are_near(here.true_shares(), here.start_shares())

    def test_release_takes_the_torque_of_all_and_is_confirmed(self, twin, held):
        twin.run(held, 0.05)
        assert all(twin.holding())
        held.disable_torque()
        assert twin.holding() == [False] * twin.count
        readings = twin.run(held, 0.1, twin.away_shares())
        assert not any(r.torque for r in readings)
        assert twin.are_near(twin.true_shares(), twin.start_shares())
        assert "refused" not in held.health().errors
        # A busy machine may delay the emulator, which is not a fault of the bus.
        assert [
            line for line in held.events() if not line.startswith("this computer was busy")
        ] == []

    def test_a_bus_is_opened_again_and_closed_twice(self, here):
        bus = here.bus()
        for _ in range(2):
            here.pulses_on()
            bus.open()
            bus.enable_torque()
            assert here.are_near(
                here.measured_shares(rows(bus.read(here.now_s()))), here.start_shares()
            )
            bus.disable_torque()
            bus.close()
            bus.close()

    def test_bytes_are_counted_and_no_errors(self, here, held_here):
        before = held_here.health()
        here.run(held_here, 0.1, here.start_shares())
        after = held_here.health()
        assert after.tx_bytes > before.tx_bytes > 0
        assert after.rx_bytes > before.rx_bytes > 0
        assert after.errors == {}
        assert held_here.faults() == ()

    # --- other limits

    def test_retune_waits_for_the_next_torque(self, here):
        here.pulses_on()
        bus = here.bus()
        bus.open()
        bus.enable_torque()
        narrow = [
            s._replace(min_steps=at - 40, max_steps=at + 40)
            for s, at in zip(here.setups, here.steps([0.5] * here.count), strict=True)
        ]
        bus.retune(narrow)
        here.run(bus, 1.5, here.away_shares())
        assert here.are_near(here.true_shares(), here.away_shares())
        bus.disable_torque()
        goals = bus.enable_torque()
        for setup, goal in zip(narrow, goals, strict=True):
            assert setup.min_steps <= goal <= setup.max_steps
        here.run(bus, 1.0, here.away_shares())
        for setup, goal in zip(narrow, here.true_goals_steps(), strict=True):
            assert setup.min_steps <= goal <= setup.max_steps
        with pytest.raises(ValueError, match="ids and models must not change"):
            bus.retune([s._replace(id=s.id + 1) for s in narrow])
        with pytest.raises(ValueError, match="ids and models must not change"):
            bus.retune(narrow[:-1])

    # --- properties

    def test_a_goal_between_two_steps_is_rounded(self, another):
        twin = another().bench
        twin.pulses_on()
        bus = twin.bus()
        bus.open()
        bus.enable_torque()
        bus.read(twin.now_s())
        middle = [(setup.min_steps + setup.max_steps) // 2 for setup in twin.setups]
        bus.write([steps + 0.4 for steps in middle])
        twin.wait(0.02)
        for place in twin.smart_indices():
            assert twin.true_goals_steps()[place] == middle[place]

    @settings(
        max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
    )
    @given(data=st.data())
    def test_no_goal_outside_the_limits_ever_reaches_a_servo(self, another, data):
        inside = another()
        twin = inside.bench
        twin.pulses_on()
        bus = twin.bus()
        bus.open()
        bus.enable_torque()
        every = data.draw(
            st.lists(st.lists(ANY, min_size=twin.count, max_size=twin.count), max_size=6)
        )
        twin.command(data.draw(st.sampled_from(FAULTS)) or "clear")
        for goals in every:
            bus.read(twin.now_s())
            before = len(inside.sent)
            try:
                bus.write(goals)
            except ValueError:
                assert any(goal != goal for goal in goals)
                assert len(inside.sent) == before
            for setup, goal in zip(twin.setups, twin.true_goals_steps(), strict=True):
                assert goal is None or setup.min_steps <= goal <= setup.max_steps
            twin.wait(0.02)
        # No servo goes beyond, except by its own inertia.
        assert all(-0.02 <= share <= 1.02 for share in twin.true_shares())
