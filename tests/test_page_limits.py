"""What a browser of the page may take and ask for, and a stop that nobody answers."""

import asyncio
import time
from contextlib import ExitStack
from typing import Any

import pytest
from page_at_the_door import opened

from gazerig.robot.dashboard.door.browsers import TabLimits
from gazerig.robot.dashboard.requests.outbox import TokenBucket, from_browser


def test_a_place_is_left_by_the_browser_with_the_most() -> None:
    async def crowd() -> list[str]:
        places, left = TabLimits(3), []
        with ExitStack() as stack:
            for name in ("a", "b", "b", "c", "d"):
                leave = stack.enter_context(places.take(name))
                left.append((name, leave))
            return [name for name, leave in left if leave.is_set()]

    assert asyncio.run(crowd()) == ["a", "b"] or asyncio.run(crowd()) == ["b", "a"]


def test_a_rate_lets_a_burst_pass_and_then_so_many_a_second() -> None:
    rate = TokenBucket(10.0, 5.0)
    assert [rate.take(0.0) for _ in range(7)] == [True] * 5 + [False] * 2
    assert sum(rate.take(0.001 * n) for n in range(1000)) == pytest.approx(10, abs=1)
    assert rate.take(1e6) and rate.wait_s(1e6) == 0.0


def test_only_small_objects_are_asked_for() -> None:
    assert from_browser(b'{"a": [1, 2]}', "me") == {"a": [1, 2]}
    assert from_browser(b"[]", "me") is None and from_browser(b"{", "me") is None
    assert from_browser('{"do": "stop", "why": "x", "who": "you"}', "me") == {
        "do": "stop", "why": "x", "who": "me",
    }  # fmt: skip


def test_a_stop_that_the_rig_does_not_answer_is_said_and_the_next_one_is_sent() -> None:
    with opened("127.0.0.1") as rig:
        stall = [True]

        def stalls(asked: Any) -> str:
            while stall[0]:
                time.sleep(0.02)
            return ""

        rig.stop = stalls  # type: ignore[method-assign]
        rig._listener._take = stalls
        status, _, text = rig.post(b'{"do": "stop", "why": "x"}')
        assert status == 503 and "does not answer" in text
        stall[0] = False
        for _ in range(100):
            if rig.post(b'{"do": "stop", "why": "x"}')[0] == 204:
                break
        else:
            raise AssertionError("no stop was taken")
