"""Who is on the bus: broadcast at every baud rate, pieces, shared ids, the old protocol, ports."""

import os

from gazerig.drivers.dynamixel.control_table import BAUD_RATES
from gazerig.drivers.dynamixel.discovery import (
    COMMON_FIRST,
    Found,
    ask_one,
    everybody,
    garbled,
    known_bauds,
    old_answers,
    ping,
    scan,
)
from gazerig.drivers.serial.list_ports import (
    Host,
    access,
    holders,
    latency_file,
    latency_ms,
    serial_ports,
    set_latency,
)
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

SPECS = (
    ServoSpec(9, "xc330-m288", 2100, 53),
    ServoSpec(1, "xl330-m077", 2000, 45),
    ServoSpec(250, "xl430-w250", 1000, 46),
)


def bus(specs=SPECS, bauds=None, now=lambda: 0.0):
    """Return a port to servos, each at its own baud rate, or heard at every one."""
    chain = build_dynamixel(specs, now)
    for servo, baud in zip(chain.servos, bauds or (), strict=False):
        servo.memory.set("baud_rate", BAUD_RATES.index(baud))
    if bauds is not None:
        chain.choose("baud", "heed")
    chain.refresh()
    return InProcessPort(chain)


def test_broadcast_finds_everybody_with_model_and_firmware():
    port = bus()
    port.setBaudRate(57_600)
    found, junk = everybody(port, 57_600)
    assert found == (
        Found(1, 1190, 45, 57_600),
        Found(9, 1240, 53, 57_600),
        Found(250, 1060, 46, 57_600),
    )
    assert (junk, found[0].model) == (0, "xl330-m077")
    assert Found(1, 350, 1, 57_600).model == "model number 350"


def test_every_baud_rate_is_asked_and_each_servo_found_where_it_is():
    port = bus(bauds=(57_600, 1_000_000, 4_500_000))
    rounds = list(scan(port))
    assert [one.baud for one in rounds] == list(COMMON_FIRST)
    assert {one.baud: [f.id for f in one.found] for one in rounds if one.found} == {
        1_000_000: [1],
        57_600: [9],
        4_500_000: [250],
    }


def test_a_rate_the_adaptor_cannot_run_at_is_passed_over():
    port = bus()
    port.setBaudRate = lambda baud: baud != 4_500_000 and InProcessPort.setBaudRate(port, baud)
    rounds = list(scan(port, (4_500_000, 57_600)))
    assert [(one.possible, len(one.found)) for one in rounds] == [(False, 0), (True, 3)]


def test_noise_and_an_echo_hide_nobody():
    port = bus()
    port.setBaudRate(57_600)
    for command in ("noise before FFFFFD00", "noise after random", "echo on", "fragment all"):
        port.faults.command(command)
    found, junk = everybody(port, 57_600)
    assert [one.id for one in found] == [1, 9, 250] and junk > 0


def test_latched_errors_and_stuffed_answers_are_heard():
    port = bus()
    port.setBaudRate(57_600)
    port.faults.command("overload 9")
    assert ping(port, 9, 57_600).model == "xc330-m288"
    assert garbled(port, 9) == 0


def test_one_servo_is_asked_alone():
    port = bus()
    port.setBaudRate(57_600)
    assert ping(port, 9, 57_600) == Found(9, 1240, 53, 57_600)
    assert ping(port, 3, 57_600) is None
    port.faults.command("wrong-id 9 4")
    assert ping(port, 9, 57_600) is None
    port.faults.command("clear")
    port.faults.command("lose 9 count 1")
    assert ping(port, 9, 57_600) is not None
    port.faults.command("refuse 9 7")
    assert ping(port, 9, 57_600) is None


def test_two_servos_with_one_id_answer_in_pieces():
    port = bus()
    port.setBaudRate(57_600)
    assert garbled(port, 1) == 0 == garbled(port, 77)
    port.faults.command("collide 1")
    # Their pings are equal and look healthy.
    assert ping(port, 1, 57_600) is not None
    assert garbled(port, 1) >= 2
    assert garbled(port, 9) == 0
    (one,) = scan(port, (57_600,))
    assert one.shared == (1,)


class ScriptedPort:
    """A port that answers every write with the same bytes, at a byte a read."""

    port_name, baudrate = "script", 57_600

    def __init__(self, *answers):
        self.answers, self.waiting, self.time_s = list(answers), b"", 0.0

    def now_s(self):
        return self.time_s

    def setBaudRate(self, baud):
        return True

    def write(self, data):
        self.waiting = self.answers.pop(0) if self.answers else b""

    def drain(self):
        self.waiting = b""
        return 0

    def read_until(self, length, deadline_s):
        taken, self.waiting = self.waiting[:length], self.waiting[length:]
        self.time_s = deadline_s if len(taken) < length else self.time_s + 0.0002
        return taken


def test_the_old_protocol_is_noticed():
    assert old_answers(b"\xff\xff\x05\x02\x00\xf8") == (5,)
    assert old_answers(b"\x00\xff\xff\xff\x05\x02\x00\xf8\xff\xff\x06\x02\x20\xd7") == (5, 6)
    assert old_answers(b"\xff\xff\x05\x02\x00\xf9") == ()  # checksum
    assert old_answers(b"\xff\xff\xfe\x02\x01\xfe") == ()  # the question, echoed
    assert old_answers(b"\xff\xff\x05\x02") == ()
    (one,) = scan(ScriptedPort(b"", b"\xff\xff\x05\x02\x00\xf8"), (57_600,))
    assert one.found == () and one.protocol_1 == (5,)


def test_listening_ends_on_a_line_that_never_falls_silent():
    port = ScriptedPort(b"\xff\xff\xfd\x00" * 10_000, b"")
    found, junk = everybody(port, 57_600)
    assert found == () and 0 < junk < 10_000
    assert port.time_s < 5.0


def test_a_thorough_scan_waits_as_long_as_the_sdk():
    quick, thorough = ScriptedPort(), ScriptedPort()
    list(scan(quick, (57_600,)))
    list(scan(thorough, (57_600,), thorough=True))
    assert quick.time_s < 0.2 and thorough.time_s > 0.77


def test_an_answer_in_time_is_not_waited_beyond():
    port = ScriptedPort(bytes.fromhex("FFFFFD0001070055000604 26655D".replace(" ", "")))
    heard = ask_one(port, b"ping", 14)
    assert [s.id for s in heard.answers] == [1] and heard.junk == 0
    assert port.time_s < 0.01


def test_bauds_of_the_models():
    assert 4_500_000 not in known_bauds("xl330-m077") and 4_500_000 in known_bauds("xm430-w350")


# --- ports as the system shows them


def test_access_and_holders(tmp_path):
    device = tmp_path / "tty"
    assert not access(str(device)).exists
    device.write_text("")
    found = access(str(device))
    assert found.exists and not found.serial and found.group
    master, slave = os.openpty()
    try:
        assert access(os.ttyname(slave)).serial
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
    assert holders(str(device), host) == ("minicom (process 12)",)


def test_latency_timer(tmp_path):
    host = Host(latency=tmp_path)
    assert latency_file("/dev/ttyUSB0", host) is None
    (tmp_path / "ttyUSB0").mkdir()
    (tmp_path / "ttyUSB0" / "latency_timer").write_text("16\n")
    file = latency_file("/dev/ttyUSB0", host)
    assert latency_ms(file) == 16
    assert set_latency(file) and latency_ms(file) == 1
    assert latency_ms(tmp_path / "none") is None
    assert not set_latency(tmp_path / "none" / "latency_timer")


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


def test_a_system_without_lasting_names(tmp_path):
    assert all(port.by_id is None for port in serial_ports(Host(by_id=tmp_path / "none")))
