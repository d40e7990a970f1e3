"""Common behaviour of emulated servos of every make: answers, groups, restarts."""

import pytest
from servo_bench import (
    ALL,
    MAKES,
    PING,
    WRITE,
)

BAUD = 1_000_000


@pytest.fixture(params=MAKES, ids=lambda make: make.model)
def make(request):
    return request.param


def ids(said):
    return [servo_id for servo_id, _, _ in said]


# --- who is there


def test_only_a_client_at_the_servos_baud_rate_is_heard(make):
    bench = make(baud=BAUD)
    assert bench.ask(1, PING, baud=115_200) == []
    assert len(bench.ask(1, PING, baud=BAUD)) == 1
    # A new rate counts behind the answer.
    slower = bench.chain.servos[0].baud_rates.index(115_200)
    assert ids(bench.ask(1, WRITE, bench.head_of("baud_rate"), slower, baud=BAUD)) == [1]
    assert [len(bench.ask(1, PING, baud=baud)) for baud in (BAUD, 115_200, 9600)] == [0, 1, 0]
    assert [len(bench.ask(ALL, PING, baud=baud)) for baud in (115_200, BAUD)] == [1, 0]
