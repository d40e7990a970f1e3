"""The serial port: waiting, time limits, and errors that name the cure."""

import errno
import os
import pty
import tty

import pytest
from serial.tools import list_ports

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.serial.list_ports import open_failure_text
from gazerig.drivers.serial.port import BlockingPort


@pytest.fixture
def line():
    """A terminal: (master descriptor, opened port)."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    port = BlockingPort(os.ttyname(slave))
    port.setBaudRate(1_000_000)
    yield master, port
    port.closePort()
    for fd in (master, slave):
        try:
            os.close(fd)
        except OSError:
            assert fd == master  # a test may have hung up


def test_read_until_gives_the_bytes_asked_for_and_leaves_the_rest(line):
    master, port = line
    os.write(master, b"abcdef")
    assert port.read_until(4, port.now_s() + 5.0) == b"abcd"
    assert port.read_until(2, port.now_s() + 5.0) == b"ef"


def test_read_until_gives_what_came_before_the_deadline(line):
    master, port = line
    os.write(master, b"ab")
    assert port.read_until(4, port.now_s() + 0.05) == b"ab"
    assert port.read_until(4, port.now_s() - 1.0) == b""


def test_drain_empties_the_line(line):
    master, port = line
    os.write(master, b"x" * 100)
    assert port.drain() == 100
    assert port.drain() == 0
    os.write(master, b"y")
    assert port.drain(0.0) == 1
    assert port.read_until(1, port.now_s()) == b""


def test_a_line_that_takes_nothing_is_a_lost_bus(line):
    _, port = line
    began_s = port.now_s()
    with pytest.raises(BusLost, match="accepts no more bytes"):
        for _ in range(1000):
            port.write(b"x" * 1024)
    assert port.now_s() - began_s >= 0.05


def test_a_hang_up_is_a_lost_bus(line):
    master, port = line
    os.close(master)
    for use in (
        lambda: port.read_until(1, port.now_s() + 5.0),
        port.drain,
        lambda: port.write(b"x"),
    ):
        with pytest.raises(BusLost, match=f"{port.port_name} is gone .*: check USB cable"):
            use()


def test_a_port_whose_path_is_gone_was_unplugged(line):
    _, port = line
    port.opened_as += "-gone"
    with pytest.raises(BusLost, match=r"it was unplugged"):
        port.read_until(1, port.now_s())


def test_an_absent_port_is_named_with_the_ports_there_are(monkeypatch):
    class Found:
        device, description = "/dev/ttyACM7", "U2D2"

    monkeypatch.setattr(list_ports, "comports", lambda: [Found])
    with pytest.raises(PortError) as caught:
        BlockingPort("/dev/ttyUSB99").setBaudRate(1_000_000)
    assert str(caught.value) == (
        "no serial port /dev/ttyUSB99: plug the adapter in; ports here: /dev/ttyACM7 (U2D2)"
    )


def test_a_port_without_rights_names_the_cure():
    text = open_failure_text("/dev/ttyUSB0", errno.EACCES)
    assert "no permission to open /dev/ttyUSB0: join its group with 'sudo usermod -aG" in text


def test_a_busy_port_is_named(line):
    _, port = line
    with pytest.raises(PortError, match="is busy: close the other program"):
        BlockingPort(port.port_name).setBaudRate(1_000_000)


def test_what_is_not_a_serial_port_is_named(tmp_path):
    plain = tmp_path / "file"
    plain.write_bytes(b"")
    with pytest.raises(PortError, match=f"cannot open {plain}"):
        BlockingPort(str(plain)).setBaudRate(1_000_000)
