"""Damaged and hostile recordings: one line each, or the right result; never another."""

import random
import resource
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import zstandard
from fakes.runs import record
from mcap.opcode import Opcode

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import DriverError
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.recording.gaze_angles import collect_gaze_angles
from gazerig.robot.recording.read import BadRecording, RunRecording, report_bad_contents

HEAD = 9


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Return kind, offset and length of every record."""
    at = 8
    while at + HEAD <= len(data) - 8:
        kind, length = data[at], int.from_bytes(data[at + 1 : at + HEAD], "little")
        yield kind, at, length
        at += HEAD + length


# -- damage ----------------------------------------------------------------------------


def flipped(data: bytes, rng: random.Random) -> bytes:
    """Flip 1 to 8 bits anywhere."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def cut(data: bytes, rng: random.Random) -> bytes:
    """End the file early."""
    return data[: rng.randrange(len(data))]


def overwritten(data: bytes, rng: random.Random) -> bytes:
    """Put zeros, ones or noise over a stretch, as a bad sector does."""
    at, size = rng.randrange(len(data)), rng.choice((1, 16, 512, 4096))
    fill = rng.choice((b"\0" * size, b"\xff" * size, rng.randbytes(size)))
    return data[:at] + fill[: len(data) - at] + data[at + size :]


_BOMBS: dict[int, bytes] = {}


def with_bomb(data: bytes, size: int, honest: bool) -> bytes:
    """Put a chunk of ``size`` zero bytes in place of the first; honest: with its true size."""
    if size not in _BOMBS:
        packer = zstandard.ZstdCompressor(level=1).compressobj()
        piece = bytes(1 << 20)
        parts = [packer.compress(piece) for _ in range(size >> 20)]
        _BOMBS[size] = b"".join([*parts, packer.flush()])
    packed = _BOMBS[size]
    at, length = next((at, n) for kind, at, n in records(data) if kind == Opcode.CHUNK)
    body = struct.pack("<QQQII", 0, 1, size if honest else 1 << 20, 0, 4) + b"zstd"
    body += struct.pack("<Q", len(packed)) + packed
    return _unsummed(
        data[: at + 1] + struct.pack("<Q", len(body)) + body + data[at + HEAD + length :]
    )


def _unsummed(data: bytes) -> bytes:
    """Return the data without the checksum of the whole, as an attacker would send it."""
    out = bytearray(data)
    for kind, at, _ in records(data):
        if kind == Opcode.DATA_END:
            out[at + HEAD : at + HEAD + 4] = bytes(4)
    return bytes(out)


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    flipped, flipped, cut, overwritten,
)  # fmt: skip


# -- what is made of it ----------------------------------------------------------------


def _exported(file: Path) -> object:
    with report_bad_contents(file):
        return collect_gaze_angles(RunRecording(file).ticks()).time_s.tolist()


def _again(file: Path) -> object:
    with report_bad_contents(file):
        done = rerun(RunRecording(file))
    return done.ticks, done.is_same


def _reported(file: Path) -> object:
    pytest.importorskip("gazerig.features.lab")
    from gazerig.features.lab.cli.report import _recording_header
    from gazerig.features.lab.report.report import read_run

    recording = RunRecording(file)
    about = _recording_header(recording, "x")
    with report_bad_contents(file):
        return len(read_run(recording.ticks(), about, lambda words, share: None).rows)


USES: dict[str, Callable[[Path], object]] = {
    "export": _exported, "rerun": _again, "report": _reported,
}  # fmt: skip


@dataclass
class Tally:
    """Results of many damaged files."""

    refused: int = 0
    right: int = 0
    partly: int = 0
    wrong: list[str] = field(default_factory=list)


def judge(data: bytes, folder: Path, count: int, seed: int, uses: tuple[str, ...]) -> Tally:
    """Damage a recording ``count`` times and use each; every one must be refused or right.

    Right is the whole run, or its beginning if the file is marked as incomplete.
    """
    whole, file, tally = folder / "whole.mcap", folder / "damaged.mcap", Tally()
    whole.write_bytes(data)
    truth = {name: USES[name](whole) for name in uses}
    assert all(truth.values()), f"nothing to damage: {truth}"
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        damage, name = rng.choice(DAMAGES), uses[number % len(uses)]
        file.write_bytes(damage(data, rng))
        what = f"{damage.__name__} {seed} {number} {name}"
        try:
            made = USES[name](file)
        except DriverError as error:
            tally.refused += 1
            if "\n" in str(error) or not str(error):
                tally.wrong.append(f"{what}: not one line: {error}")
        except Exception as error:  # noqa: BLE001 S112
            tally.wrong.append(f"{what}: {type(error).__name__}: {error}")
        else:
            if made == truth[name]:
                tally.right += 1
            elif RunRecording(file).note:
                tally.partly += 1  # as of a killed run
            else:
                tally.wrong.append(f"{what}: another result and no word")
    return tally


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    record(path, load_rig("desk"), 0.3)
    return path.read_bytes()


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
