"""Promises of every kind of servo bus: the suite that packages run on theirs."""

from collections.abc import Iterator

import pytest
from bus_kinds import KINDS, TICK_S, behind_a_terminal, in_process

from gazerig.drivers.errors import BusLost
from gazerig.testing import BusBench, BusSuite
from gazerig.testing.bus_suite import AWAY, START


class TestEveryKind(BusSuite):
    @pytest.fixture(params=KINDS)
    def bench(self, request: pytest.FixtureRequest) -> BusBench:
        return in_process(request.param)

    def test_new_limits_count_from_the_next_torque_on(self, bench, bus):
        middle = (bench.kind.low + bench.kind.high) // 2
        low, high = middle - 40, middle + 40
        bus.retune([s._replace(min_steps=low, max_steps=high) for s in bench.setups])
        bench.run(bus, 1.5, AWAY)
        assert bench.are_near(bench.true_steps(), AWAY)
        bus.disable_torque()
        assert all(low <= goal <= high for goal in bus.enable_torque())
        bench.run(bus, 1.0, AWAY)
        assert all(low <= goal <= high for goal in bench.true_goals_steps())
        with pytest.raises(ValueError, match="ids and models must not change"):
            bus.retune([s._replace(id=s.id + 1) for s in bench.setups])

    def test_no_read_takes_long_while_nobody_answers(self, bench):
        bus = bench.hold(give_up_s=2.0)
        bench.run(bus, 0.5, START)
        bench.command("lose all")
        spent = []
        with pytest.raises(BusLost, match="answered for 2"):
            for _ in range(1000):
                began_s = bench.now_s()
                bus.read(began_s)
                spent.append(bench.now_s() - began_s)
                bus.write(bench.steps(START))
                bench.wait(TICK_S)
        assert max(spent) < 0.1


@pytest.mark.pty
class TestBehindATerminal:
    @pytest.fixture(params=["dynamixel", "feetech"])
    def bench(self, request: pytest.FixtureRequest) -> Iterator[BusBench]:
        with behind_a_terminal(request.param) as bench:
            yield bench

    bus = BusSuite.bus
    recover = BusSuite.recover
    test_goals = BusSuite.test_goals_are_followed_and_told
    test_release = BusSuite.test_torque_on_holds_every_servo_where_it_is_until_its_release
    test_unplugged = BusSuite.test_an_unplugged_port_comes_back_and_holds
