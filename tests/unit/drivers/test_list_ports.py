"""Serial ports as the system shows them, with the names that they keep."""

from gazerig.drivers.serial.list_ports import serial_ports, usb_id_of


def test_ports_have_lasting_names(tmp_path, monkeypatch):
    class Info:
        def __init__(self, device, vid, pid):
            self.device, self.description, self.vid, self.pid = device, "adaptor", vid, pid

    (tmp_path / "usb-FTDI-if00").symlink_to("/dev/ttyUSB7")
    known = [Info("/dev/ttyS0", None, None), Info("/dev/ttyUSB7", 0x0403, 0x6014)]
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: known)
    first, second = serial_ports(tmp_path)
    assert (first.device, first.usb) == ("/dev/ttyUSB7", "0403:6014")
    assert first.by_id == str(tmp_path / "usb-FTDI-if00")
    assert (second.usb, second.by_id) == ("", None)
    paths = "/dev/ttyUSB7", "/dev/ttyS0", "/dev/none"
    assert [usb_id_of(path, (first, second)) for path in paths] == ["0403:6014", "", ""]
