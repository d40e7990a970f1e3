"""Damaged and hostile recordings: one line each, or the right result; never another."""

import resource
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from recording_damage import USES, judge, recorded, records, with_bomb

from gazerig.drivers.errors import DriverError
from gazerig.robot.recording.read import BadRecording, RunRecording


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return recorded(tmp_path_factory.mktemp("run") / "run.mcap", 0.3)


def test_every_damage_is_refused_or_changes_nothing(run: bytes, tmp_path: Path) -> None:
    tally = judge(run, tmp_path, 100, 1, tuple(USES))
    assert tally.wrong == []
    assert tally.refused > 50 and tally.right > 3


@pytest.mark.parametrize("honest", [True, False])
def test_a_bomb_is_refused_before_it_is_unpacked(run: bytes, tmp_path: Path, honest: bool) -> None:
    file = tmp_path / "bomb.mcap"
    file.write_bytes(with_bomb(run, 300 << 20, honest))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(DriverError, match="a chunk (of|whose)"):
        USES["export"](file)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 150_000  # kB


def test_one_wrong_bit_anywhere_before_the_end_is_known(run: bytes, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    end = next(at for kind, at, _ in records(run) if kind == Opcode.DATA_END)
    for at in range(8, end, end // 200):
        damaged = bytearray(run)
        damaged[at] ^= 4
        file.write_bytes(damaged)
        with pytest.raises(BadRecording):
            list(RunRecording(file).ticks())
