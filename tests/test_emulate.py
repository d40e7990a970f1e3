"""The command that emulates servos: what it prints, takes, refuses, and how it ends."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler
from typer.testing import CliRunner

from drivers.errors import SetupError
from drivers.serial_port import BlockingPort
from robot.cli.emulate import app, parse_servos

ROOT = Path(__file__).parents[1]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGTTIN)
COMMAND = [sys.executable, "-c", "from robot.cli.emulate import app; app()"]


class Emulator:
    """The command in a process of its own."""

    def __init__(self, *options, **how):
        how = {"stdin": subprocess.PIPE, **how}
        self.process = subprocess.Popen(
            [*COMMAND, *options], cwd=ROOT, stdout=subprocess.PIPE, text=True, **how
        )
        self.ready = self.hear()
        self.path = self.ready["path"]

    def hear(self):
        return json.loads(self.process.stdout.readline())

    def type(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.hear()

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        code = self.process.wait(10)
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()
        return code


def connect(path, baud=1_000_000):
    port = BlockingPort(str(path))
    port.setBaudRate(baud)
    return port


def ping(port, servo_id):
    return PacketHandler(2.0).ping(port, servo_id)[:2]


def test_it_serves_commands_and_clients_that_come_and_go(tmp_path):
    link = tmp_path / "servos"
    emulator = Emulator("--servos", "1-2:xl330-m077,7:xc330-m288@100", "--link", str(link))
    assert emulator.ready == {"path": str(link), "baud": 1_000_000}
    for _ in range(2):
        port = connect(link)
        assert ping(port, 2) == (1190, COMM_SUCCESS)
        assert ping(port, 7) == (1240, COMM_SUCCESS)
        port.closePort()
    told = emulator.type("status")
    assert [servo["id"] for servo in told["servos"]] == [1, 2, 7]
    assert told["servos"][2]["position"] == 100
    assert "ok" in emulator.type("lose 1 count 1")
    assert "'x' is not a servo id" in emulator.type("lose x")["error"]
    assert "lose ID" in emulator.type("help")["ok"]
    port = connect(link)
    assert ping(port, 1)[1] != COMM_SUCCESS
    assert ping(port, 1)[1] == COMM_SUCCESS
    port.closePort()
    assert emulator.end(signal.SIGINT) == 0
    assert not os.path.lexists(link)


def test_it_stays_without_standard_input_and_ends_on_sigterm(tmp_path):
    link = tmp_path / "servos"
    with open(os.devnull) as nothing:
        emulator = Emulator("--rig", "desk", "--firmware", "45", "--link", str(link), stdin=nothing)
    port = connect(link)
    assert PacketHandler(2.0).read1ByteTxRx(port, 9, 6) == (45, COMM_SUCCESS, 0)
    port.closePort()
    assert emulator.end(signal.SIGTERM) == 0


def test_it_ends_with_standard_input_when_told_to():
    emulator = Emulator("--servos", "1:xl330-m077", "--until-eof")
    emulator.process.stdin.close()
    assert emulator.process.wait(10) == 0
    emulator.process.stdout.close()


def test_without_a_link_a_new_path_is_told_after_the_plug_is_back():
    emulator = Emulator("--servos", "1:xl330-m077", "--baud", "4000000")
    port = connect(emulator.path, 4_000_000)
    assert "ok" in emulator.type("unplug")
    answer = emulator.type("plug")
    path = answer.get("path", emulator.path)
    again = connect(path, 4_000_000)
    assert ping(again, 1) == (1190, COMM_SUCCESS)
    for one in (port, again):
        one.closePort()
    assert emulator.end() == 0


def test_a_link_that_is_left_over_is_replaced(tmp_path):
    link = tmp_path / "servos"
    link.symlink_to("/dev/pts/999999")
    emulator = Emulator("--servos", "1:xl330-m077", "--link", str(link))
    assert ping(connect(link), 1) == (1190, COMM_SUCCESS)
    assert emulator.end() == 0


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "name the servos: --servos 1-6:xl330-m077"),
        (("--servos", "1:xl330-m077", "--rig", "desk"), "name the servos"),
        (("--rig", "nobody"), "there are desk"),
        (("--servos", "1:xl330-m077", "--baud", "12"), "--baud 12: servos know 9600"),
        (("--servos", "1:xl330-m077", "--set", "bad-crc"), "not CASE=VALUE"),
        (("--servos", "1:xl330-m077", "--set", "bad-crc=no"), "it can be silent, reply"),
        (("--servos", "1:xl330-m077", "--baud", "4500000"), "xl330-m077 does not know it"),
        (("--servos", "1:xl330-m077", "--link", "/nowhere/x"), "/nowhere/x: No such file"),
        (("--servos", "1:xl330-m077", "--link", "README.md"), "something else has this name"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_bad_input_is_one_clear_line(options, says, monkeypatch):
    monkeypatch.chdir(ROOT)
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        done = CliRunner().invoke(app, options)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert done.exit_code == 2
    assert says in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not IDS:MODEL"),
        ("1", "not IDS:MODEL"),
        ("1:xl330-m077,", "not IDS:MODEL"),
        ("a:xl330-m077", "not IDS:MODEL"),
        ("5-3:xl330-m077", "ids run upwards"),
        ("250-253:xl330-m077", "from 0 to 252"),
        ("1:xl331", "unknown model; there is xl330-m077"),
        ("1-3:xl330-m077,2:xc330-m288", "id 2 is taken by a xl330-m077"),
    ],
)
def test_servos_that_cannot_be_are_refused(text, says):
    with pytest.raises(SetupError) as error:
        parse_servos(text, 53)
    assert says in str(error.value)


def test_servos_are_read():
    specs = parse_servos("0-2:XL330-M077, 9:xc330-m288@17", 45)
    assert [(s.id, s.model, s.start_steps, s.firmware) for s in specs] == [
        (0, "xl330-m077", 2048, 45),
        (1, "xl330-m077", 2048, 45),
        (2, "xl330-m077", 2048, 45),
        (9, "xc330-m288", 17, 45),
    ]
