"""Recordings damaged by disks, cables and attackers, and the program's message for each."""

import random
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import pytest
import zstandard
from mcap.opcode import Opcode

from gazerig.config.save_text import params_text
from gazerig.config.schema import load_rig, load_walk
from gazerig.drivers.errors import DriverError
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.control.loop import run
from gazerig.robot.recording.gaze_angles import collect_gaze_angles
from gazerig.robot.recording.read import RunRecording, report_bad_contents
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo

HEAD = 9


def recorded(path: Path, seconds: float = 0.5) -> bytes:
    """Record a short run as ``gazerig run --fast --record`` does; return the file's bytes."""
    options, rig = RunOptions(mock=True, fast=True, seed=5, scene="visitor"), load_rig("desk")
    info = RunInfo(
        rig="desk", profile=rig.profile, config_yaml=params_text(rig),
        walk_yaml=params_text(load_walk(rig.gaze.scanpath.transition_matrix)), seed=5, rate_hz=rig.loop.rate_hz,
        started_utc=datetime(2026, 1, 31, 23, 59, 59, tzinfo=UTC), scene="visitor", mock=True, fast=True,
    )  # fmt: skip
    recorder = Recorder(path, info, patient=True)
    made = assemble(rig, options, Substitutes(body=recorder.wrap_body))
    recorder.open()
    made.robot.start(made.clock)
    stop = recorder.wrap_stop(lambda s: "seconds" if s >= seconds else None)
    try:
        run(made.robot, made.clock, made.loop, stop, recorder.record)
        made.robot.stop()
    finally:
        made.close()
        recorder.close("seconds", made.sent_bytes_digest())
    return path.read_bytes()


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
