"""Rates of messages: what a client may send, and when it is hung up on."""

import pytest

from gazerig.robot.net.excess import ExcessCount, TokenBucket


def test_a_bucket_gives_its_burst_and_then_its_rate():
    bucket = TokenBucket(2.0, 3.0)
    assert [bucket.take(5.0) for _ in range(4)] == [True, True, True, False]
    bucket.spend(1.0)
    for now_s, wait_s in ((5.0, 0.5), (5.25, 0.25), (4.0, 0.25), (4.25, 0.0), (99.0, 0.0)):
        assert bucket.wait_s(now_s) == pytest.approx(wait_s, abs=1e-8)
    assert [bucket.take(99.0, 2.0) for _ in range(3)] == [True, True, False]


@pytest.mark.parametrize(
    ("rows", "over"),
    [
        ([(200, 5.0), (0, 6.0)], False),
        ([(201, 5.0), (0, 5.99)], False),
        ([(100, 5.0), (101, 5.9), (0, 6.0)], True),
        ([(100, 5.0), (0, 6.0), (101, 6.5), (0, 7.5)], False),
        ([(100_000, 5.0)], False),
        ([(100_001, 5.0)], True),
    ],
)
def test_two_hundred_refusals_in_a_second_are_enough(rows, over):
    count = ExcessCount()
    for late, now_s in rows:
        count.add(late, now_s)
    assert count.is_over is over
