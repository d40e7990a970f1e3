"""Lines for people go to a pipe without a reader, or whose reader has gone, without waiting."""

import fcntl
import os
import time
from collections.abc import Callable

from gazerig.robot.cli.terminal import LineWriter
from gazerig.robot.loop.power_down import Interrupts


def _wait_until(true: Callable[[], bool]) -> bool:
    end_s = time.monotonic() + 20.0
    while not true() and time.monotonic() < end_s:
        time.sleep(0.02)
    return true()


def test_a_pipe_that_nobody_reads_keeps_nobody_waiting():
    reads, writes = os.pipe()
    fcntl.fcntl(writes, fcntl.F_SETPIPE_SZ, 4096)  # far less than the lines that wait
    writer = LineWriter(writes, most=50)
    for number in range(2000):
        writer.line(f"{number} " + "x" * 1000 + "\n")
        writer.status("a status\n")
    assert writer.dropped > 1000 and not writer.flush(0.05)
    got = b""
    while b"49 x" not in got:  # stored lines arrive in order once the pipe is read
        got += os.read(reads, 65536)
    assert got.startswith(b"0 x") and writer.lost_reader() is None


def test_a_reader_that_is_gone_is_told_apart_from_a_full_disk():
    reads, writes = os.pipe()
    os.close(reads)
    writer = LineWriter(writes)
    writer.line("a\n")
    assert (
        writer.flush(20.0) and "closed it" in (writer.lost_reader() or "") and writer.dropped == 1
    )
    quiet_reads, quiet_writes = os.pipe()
    quiet = LineWriter(quiet_writes)
    quiet.line("a\n")
    assert quiet.flush(20.0) and quiet.lost_reader() is None
    os.close(quiet_reads)
    assert _wait_until(lambda: quiet.lost_reader() is not None)  # without another line
    full = LineWriter(os.open("/dev/full", os.O_WRONLY))
    full.line("a\n")
    assert full.flush(20.0) and full.lost_reader() is None and full.dropped == 1


def test_a_thread_that_is_gone_ends_the_work():
    gone: list[str] = []
    with Interrupts(also=lambda: gone[0] if gone else None) as interrupts:
        assert interrupts() is None
        gone.append("nobody reads")
        assert interrupts() == "nobody reads"
