"""Ticks handed to other processes: in batches, whole, and whoever fails harms no other."""

from math import inf, nan

import numpy as np
import pytest
from msgspec import UNSET
from msgspec.structs import replace
from recorded_run import Recorded, exact, record

from gazerig.robot.loop.tick import TickRecord
from gazerig.robot.loop.tick_stream import (
    TickBatch,
    TickStream,
    all_finite,
    decode,
    encode,
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("runs") / "run.mcap", 0.5)


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


def test_every_tick_is_in_one_batch_with_every_field(recorded: Recorded):
    stream, sink = TickStream(unwanted), Sink()
    stream.sinks.add("test", sink.take)
    for tick in recorded.ticks:
        stream.update(tick)
    stream.flush()
    assert [batch.ticks for batch in sink.batches] == [1, *[8] * 12, 2]
    percept, at = None, 0
    for batch in sink.batches:
        for one in decode(batch.data, list[TickRecord]):
            percept = percept if one.percept is UNSET else one.percept
            tick = recorded.ticks[at]
            at += 1
            assert exact(one.tick) == exact(tick)
            assert repr(percept) == repr(tick.percept)
        assert batch.newest.t_s == one.tick.t_s
    assert at == len(recorded.ticks)


def test_a_percept_is_sent_again_to_who_lost_it(recorded: Recorded):
    tick = next(tick for tick in recorded.ticks if tick.percept is not None)
    for refused in ((), (1,)):
        stream, sink = TickStream(unwanted, every_s=0.0), Sink(*refused)
        stream.sinks.add("test", sink.take)
        for n in range(4):
            stream.update(replace(tick, t_s=0.005 * n))
        records = [decode(batch.data, list[TickRecord])[0] for batch in sink.batches]
        sent = [one.percept is not UNSET for one in records]
        assert sent == ([True, False, False] if refused else [True, False, False, False])


def test_numbers_keep_their_bits_and_their_type():
    values = [0, 0.0, -0.0, 1, 1.0, True, None, "1", 5e-324, 2**63, -(2**63)]
    assert repr(decode(encode(values), list)) == repr(values)
    assert repr(decode(encode([np.float64(0.1), np.arange(2.0)]), list)) == "[0.1, [0.0, 1.0]]"
    with pytest.raises(TypeError, match="object is not part of a tick"):
        encode([object()])


@pytest.mark.parametrize("odd", [nan, -nan, inf, -inf])
def test_what_is_no_finite_number_is_found(odd: float):
    assert not all_finite(encode([1.0, [odd], "text"]))
    assert all_finite(encode([1.7976931348623157e308, -5e-324, 0.0, "text", 2**63]))
