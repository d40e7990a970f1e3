"""Ticks handed to other processes: in batches, whole, and whoever fails harms no other."""

from math import inf, nan

import numpy as np
import pytest
from made_ticks import made_tick
from msgspec import UNSET
from recorded_run import exact

from gazerig.gaze.types import Percept
from gazerig.robot.loop.tick import TickRecord, TorqueRefused
from gazerig.robot.loop.tick_stream import (
    TickBatch,
    TickStream,
    all_finite,
    decode,
    encode,
)


class Sink:
    """Takes batches, except those whose numbers are named."""

    def __init__(self, *refused: int) -> None:
        self.batches: list[TickBatch] = []
        self._refused = refused
        self._number = 0

    def take(self, batch: TickBatch) -> bool:
        self._number += 1
        if self._number in self._refused:
            return False
        self.batches.append(batch)
        return True


def unwanted(line: str) -> None:
    raise AssertionError(line)


def test_every_tick_is_in_one_batch_in_time_and_a_percept_in_one_or_after_a_loss():
    """A batch every 40 ms, and at once after a leap of the time."""
    stream, sink, lost = TickStream(unwanted), Sink(), Sink(3)
    seen = [Percept(1.0), Percept(nan)]
    ticks = [made_tick(0.01 * k, percept=seen[k > 6]) for k in range(10)]
    ticks += [made_tick(t_s, percept=seen[1], events=("x",)) for t_s in (9.0, 9.01, 1.0, 1.01)]
    ticks[5:5] = [made_tick(0.041)]
    stream.update(ticks[0])  # to nobody
    stream.sinks.add("test", sink.take)
    stream.sinks.add("loses", lost.take)
    for tick in ticks[1:]:
        stream.append(tick, tick.t_s, (TorqueRefused("x"),))
    for _ in range(2):
        stream.flush()
    assert [batch.ticks for batch in sink.batches] == [4, 5, 2, 2, 1]
    records = [one for batch in sink.batches for one in decode(batch.data, list[TickRecord])]
    assert [batch.newest for batch in sink.batches] == [ticks[k] for k in (4, 9, 11, 13, 14)]
    for one, tick in zip(records, ticks[1:], strict=True):
        assert exact(one.tick) == exact(tick)
        assert (one.dt_s, one.before) == (tick.t_s, (TorqueRefused("x"),))
    sent = {k + 1: repr(one.percept) for k, one in enumerate(records) if one.percept is not UNSET}
    assert sent == {5: "None", 6: repr(seen[0]), 8: repr(seen[1]), 12: repr(seen[1])}


def test_numbers_keep_their_bits_and_their_type():
    values = [0, 0.0, -0.0, 1, 1.0, True, None, "1", 5e-324, 2**63, -(2**63)]
    assert repr(decode(encode(values), list)) == repr(values)
    assert repr(decode(encode([np.float64(0.1), np.arange(2.0)]), list)) == "[0.1, [0.0, 1.0]]"
    with pytest.raises(TypeError, match="object is not part of a tick"):
        encode([object()])


@pytest.mark.parametrize("odd", [nan, -nan, inf, -inf])
def test_what_is_no_finite_number_is_found(odd):
    assert not all_finite(encode([1.0, [odd], "text"]))
    assert all_finite(encode([1.7976931348623157e308, -5e-324, 0.0, "text", 2**63]))
