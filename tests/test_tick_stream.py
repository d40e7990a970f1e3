"""Ticks handed to other processes: in batches, whole, and whoever fails harms no other."""

from math import inf, nan

import numpy as np
import pytest
from recorded_run import Recorded, record

from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_stream import (
    TickBatch,
    TickStream,
    all_finite,
    decode_plain,
    decode_rows,
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


def test_every_tick_is_in_one_batch_with_every_field(recorded: Recorded) -> None:
    stream, sink = TickStream(unwanted), Sink()
    stream.add_sink("test", sink.take)
    for tick in recorded.ticks:
        stream.update(tick)
    stream.flush()
    assert [batch.ticks for batch in sink.batches] == [1, *[8] * 12, 2]
    percepts, rows = {}, []
    for batch in sink.batches:
        found, some = decode_rows(batch.data)
        percepts.update(found)
        assert len(some) == batch.ticks and batch.newest.t_s == some[-1].t_s
        rows += some
    for tick, row in zip(recorded.ticks, rows, strict=True):
        same = [name for name in Tick._fields if name in row._fields and name not in ("percept", "commands")]  # fmt: skip
        assert len(same) == len(Tick._fields) - 3
        back = tick._replace(**{name: getattr(row, name) for name in same})
        assert back == tick  # exact(...) of it distinguishes 30 from 30.0
        percept = None if row.percept is None else percepts[row.percept]
        assert repr(percept) == repr(tick.percept)


def test_a_percept_is_sent_again_to_who_lost_it(recorded: Recorded) -> None:
    tick = next(tick for tick in recorded.ticks if tick.percept is not None)
    for refused in ((), (1,)):
        stream, sink = TickStream(unwanted, every_s=0.0), Sink(*refused)
        stream.add_sink("test", sink.take)
        for n in range(4):
            stream.update(tick._replace(t_s=0.005 * n))
        numbers = [[one[0] for one in decode_plain(batch.data)[0]] for batch in sink.batches]
        assert numbers == ([[1], [], []] if refused else [[1], [], [], []])
        rows = [row for batch in sink.batches for row in decode_rows(batch.data)[1]]
        assert {row.percept for row in rows} == {1}


def test_numbers_keep_their_bits_and_their_type() -> None:
    values = [0, 0.0, -0.0, 1, 1.0, True, None, "1", 5e-324, 2**63, -(2**63)]
    assert repr(decode_plain(encode(values))) == repr(values)
    assert repr(decode_plain(encode([np.float64(0.1), np.arange(2.0)]))) == "[0.1, [0.0, 1.0]]"
    with pytest.raises(TypeError, match="object is not part of a tick"):
        encode([object()])


@pytest.mark.parametrize("odd", [nan, -nan, inf, -inf])
def test_what_is_no_finite_number_is_found(odd: float) -> None:
    assert not all_finite(encode([1.0, [odd], "text"]))
    assert all_finite(encode([1.7976931348623157e308, -5e-324, 0.0, "text", 2**63]))
