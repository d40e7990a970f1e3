"""Serial ports as the system shows them: access, who holds one, latency, lasting names."""

import os

from gazerig.drivers.serial.list_ports import (
    Host,
    access,
    port_users,
    serial_ports,
)


def test_access_and_holders(tmp_path):
    device = tmp_path / "tty"
    assert not access(str(device)).exists
    device.write_text("")
    found = access(str(device))
    assert found.exists and not found.is_device and found.group
    master, slave = os.openpty()
    try:
        assert access(os.ttyname(slave)).is_device
    finally:
        os.close(master)
        os.close(slave)


def test_who_holds_a_port(tmp_path):
    device = tmp_path / "ttyUSB0"
    device.write_text("")
    for number, name, target in (("12", "minicom", device), ("13", "bash", tmp_path / "else")):
        (tmp_path / "proc" / number / "fd").mkdir(parents=True)
        (tmp_path / "proc" / number / "comm").write_text(f"{name}\n")
        (tmp_path / "proc" / number / "fd" / "3").symlink_to(target)
    own = tmp_path / "proc" / str(os.getpid()) / "fd"
    own.mkdir(parents=True)
    (own / "3").symlink_to(device)
    (tmp_path / "proc" / "14").mkdir()  # may not be looked into
    host = Host(processes=tmp_path / "proc")
    assert port_users(str(device), host) == ("minicom (process 12)",)


def test_ports_have_lasting_names(tmp_path, monkeypatch):
    class Info:
        def __init__(self, device, vid, pid):
            self.device, self.description, self.vid, self.pid = device, "adaptor", vid, pid

    (tmp_path / "usb-FTDI-if00").symlink_to("/dev/ttyUSB7")
    known = [Info("/dev/ttyS0", None, None), Info("/dev/ttyUSB7", 0x0403, 0x6014)]
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: known)
    first, second = serial_ports(Host(by_id=tmp_path))
    assert (first.device, first.usb) == ("/dev/ttyUSB7", "0403:6014")
    assert first.by_id == str(tmp_path / "usb-FTDI-if00")
    assert (second.usb, second.by_id) == ("", None)
