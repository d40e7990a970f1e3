"""Promises of every kind of servo bus: the suite that packages run on theirs."""

from collections.abc import Iterator

import pytest
from bus_kinds import KINDS, behind_a_terminal, in_process

from gazerig.testing import BusBench, BusSuite


class TestEveryKind(BusSuite):
    @pytest.fixture(params=KINDS)
    def bench(self, request: pytest.FixtureRequest) -> BusBench:
        return in_process(request.param)


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
