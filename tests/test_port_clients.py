"""Actions of a client on the emulator's terminal: flush, break, lock, die, shout."""

import os
import termios
import time

import pytest
from fakes.waiting import eventually
from judged_servos import BAUD, SPECS, X430

from gazerig.sim_mock.pty.client import PtyBus


@pytest.fixture
def path():
    with PtyBus() as bus:
        yield bus.start([*SPECS, *X430], baud=BAUD)


PING = bytes.fromhex("FFFFFD0001030001194E")
PONG = 14


def answers(fd, expected, timeout_s=5.0):
    got, deadline = b"", time.monotonic() + timeout_s
    while len(got) < expected and time.monotonic() < deadline:
        try:
            got += os.read(fd, 4096)
        except BlockingIOError:
            time.sleep(0.001)
    return len(got)


@pytest.fixture(scope="module")
def shared():
    with PtyBus() as bus:
        yield bus.start([*SPECS, *X430], baud=BAUD)


@pytest.fixture
def terminal(shared):
    fd = os.open(shared, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    yield fd
    os.close(fd)


def test_bytes_one_by_one_and_packets_all_at_once(terminal):
    for byte in PING:
        os.write(terminal, bytes((byte,)))
    assert answers(terminal, PONG) == PONG
    os.write(terminal, PING * 20)
    assert answers(terminal, 20 * PONG) == 20 * PONG
    os.write(terminal, PING + PING[:4])
    assert answers(terminal, PONG) == PONG
    os.write(terminal, PING[4:])
    assert answers(terminal, PONG) == PONG


def test_every_byte_value_passes_in_both_directions(terminal):
    from fastcrc.crc16 import umts

    for start in range(0, 256, 16):
        values = bytes(range(start, start + 16))
        head = b"\xff\xff\xfd\x00\x01" + (16 + 5).to_bytes(2, "little")
        packet = head + b"\x03" + (224).to_bytes(2, "little") + values
        os.write(terminal, packet + umts(packet).to_bytes(2, "little"))
        assert answers(terminal, 11) == 11
        packet = head[:5] + b"\x07\x00\x02" + (224).to_bytes(2, "little") + b"\x10\x00"
        os.write(terminal, packet + umts(packet).to_bytes(2, "little"))
        got, deadline = b"", time.monotonic() + 30.0
        while len(got) < 27 and time.monotonic() < deadline:
            try:
                got += os.read(terminal, 4096)
            except BlockingIOError:
                time.sleep(0.001)
        assert got[9:-2] == values


def test_answers_that_a_client_did_not_read_are_not_the_next_ones(path):
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    os.write(fd, PING)
    time.sleep(0.05)
    os.close(fd)
    time.sleep(0.05)
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    with pytest.raises(BlockingIOError):
        os.read(fd, 100)
    os.write(fd, PING)
    assert answers(fd, 2 * PONG, 0.1) == PONG
    os.close(fd)


def test_a_client_killed_with_a_lock_leaves_the_port_to_the_next(path):
    """A client locks the terminal for itself and dies; the lock goes with time."""
    import fcntl

    fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    fcntl.ioctl(fd, termios.TIOCEXCL)
    os.close(fd)
    assert eventually(lambda: not locked(path))


def locked(path):
    """Return whether a terminal is locked, without being kept out by the lock oneself."""
    import fcntl
    import struct

    try:
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    except OSError:
        return True
    try:
        get_lock = 0x80045440  # TIOCGEXCL
        return bool(struct.unpack("i", fcntl.ioctl(fd, get_lock, bytes(4)))[0])
    finally:
        os.close(fd)
