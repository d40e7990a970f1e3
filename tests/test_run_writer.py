"""The process that writes a recording, piece by piece: a full disk, the disk itself, its socket."""

import errno
import os
import socket
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from random import Random

import numpy as np
import pytest
from recorded_run import info_for

from gazerig.drivers.files.file_input import MAGIC
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import writer_process as writer
from gazerig.robot.recording.run_info import RunEnd
from gazerig.robot.recording.run_writer import RunWriter

MESSAGES, A_CHUNK = 40, 10


class Written:
    """A file of noise, a chunk every ten messages.

    kept: how long it was at its beginning and after each chunk; failed: the writer's error
    """

    def __init__(self, path: Path) -> None:
        noise = Random(1)
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        made = RunWriter(fd, info_for())
        self.kept = [path.stat().st_size]
        for n in range(1, MESSAGES + 1):
            made.add(fmt.DESCRIPTION, 0.1 * n, {"data": noise.randbytes(300).hex()})
            if n % A_CHUNK == 0:
                made.flush()
                self.kept.append(path.stat().st_size)
        made.close(RunEnd("seconds"))
        self.failed, self.data = made.failed, path.read_bytes()


def limited(monkeypatch: pytest.MonkeyPatch, at_once: int, in_all: int) -> None:
    """Let the system take no more bytes at once, and in all; then the disk is full."""
    write, left = os.write, [in_all]

    def some(fd: int, data: bytes) -> int:
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        done = write(fd, bytes(data[: min(at_once, left[0])]))
        left[0] -= done
        return done

    monkeypatch.setattr(os, "write", some)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Written:
    return Written(tmp_path_factory.mktemp("whole") / "run.mcap")


def test_what_the_system_takes_in_parts_is_written_whole(
    whole: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        limited(patch, 100, 10**9)
        parts = Written(tmp_path / "run.mcap")
    assert parts.failed == "" and parts.data == whole.data


@pytest.mark.parametrize("chunks", [0, 1, 3])
def test_a_full_disk_leaves_whole_chunks_alone(
    whole: Written, chunks: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a chunk more fits on it."""
    end = whole.kept[chunks]
    with monkeypatch.context() as patch:
        limited(patch, 1000, (end + whole.kept[chunks + 1]) // 2)
        cut = Written(tmp_path / "run.mcap")
    assert cut.failed == "No space left on device"
    assert cut.data == whole.data[:end]
    at = len(MAGIC)
    while at < end:  # kind, length and content
        at += 9 + int.from_bytes(cut.data[at + 1 : at + 9], "little")
    assert at == end


def test_what_is_written_is_put_on_the_disk_every_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, at_s = SimulatedClock(), list[float]()
    monkeypatch.setattr(os, "fdatasync", lambda fd: at_s.append(clock.now_s()))

    def nothing_for(seconds: float) -> Iterator[None]:
        while clock.now_s() < seconds:
            clock.sleep_until(clock.now_s() + 0.1)
            yield None

    made = RunWriter(os.open(tmp_path / "r", os.O_WRONLY | os.O_CREAT), info_for())
    ours, theirs = socket.socketpair()
    with ours, theirs:
        writer._write(nothing_for(5.05), made, theirs, clock)
    made.close(RunEnd())
    assert np.diff([0.0, *at_s]).max() < 1.2 and at_s[-1] > 5.0  # the last one at the end


@pytest.fixture
def line() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    with ours, theirs:
        yield ours, theirs


def test_a_writer_whose_program_has_died_ends_although_a_fork_holds_its_socket(
    line: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = line
    ours.send(writer.LAST + writer.END + b"first")
    found = list(islice(writer._messages(theirs, os.getpid()), 3))  # our parent is another one
    assert [(one.kind, one.body) for one in found if one] == [(writer.END, b"first")]
    assert len(found) == 1
