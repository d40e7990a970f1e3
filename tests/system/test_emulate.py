"""The command that emulates servos: what it prints, takes, refuses, and how it ends."""

import json
import os
import signal
from pathlib import Path

from command_line import invoked
from commands_started import start
from present import present

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.transaction import Transactions

ROOT = Path(__file__).parents[2]


class Emulator:
    """The command, in a fork of this process."""

    def __init__(self, *options):
        self.process = start("emulate", *options)
        self.ready = self.hear()
        self.path = self.ready["path"]

    def hear(self):
        return json.loads(present(self.process.stdout).readline())

    def type(self, line):
        print(line, file=self.process.stdin, flush=True)
        return self.hear()

    def end(self):
        with self.process:
            self.process.send_signal(signal.SIGINT)
            return self.process.wait(60)


def connect(path, baud=1_000_000):
    port = BlockingPort(str(path))
    port.setBaudRate(baud)
    return port


def ping(port, servo_id):
    """Return a servo's model number and firmware, None without an answer."""
    line = Transactions(port, DYNAMIXEL)
    line.tries = 1
    return line.identify(servo_id)


def test_it_serves_commands_and_clients_that_come_and_go_and_refuses_bad_input(tmp_path):
    link = tmp_path / "servos"
    emulator = Emulator("--servos", "1-2:xl330-m077,7:xc330-m288@100", "--link", str(link))
    assert emulator.ready == {"path": str(link), "baud": 1_000_000}
    for _ in range(2):
        port = connect(link)
        assert ping(port, 2).model_number == 1190
        assert ping(port, 7).model_number == 1240
        port.closePort()
    reported = json.loads(emulator.type("status")["ok"])
    assert [servo["id"] for servo in reported["servos"]] == [1, 2, 7]
    assert reported["servos"][2]["position"] == 100
    assert "ok" in emulator.type("lose 1 count 1")
    assert "'x' is not ID from 0" in emulator.type("lose x")["error"]
    assert "lose ID" in emulator.type("help")["ok"]
    port = connect(link)
    assert ping(port, 1) is None
    assert ping(port, 1).model_number == 1190
    port.closePort()
    assert emulator.end() == 0
    assert not os.path.lexists(link)
    for options, message in (
        ((), "name a rig, or its servos: --servos 1-6:xl330-m077"),
        (("--servos", "1:xl330-m077", "--link", str(ROOT / "README.md")), "File exists"),
    ):
        code, out, err = invoked("emulate", *options)
        assert (code, out, message in err, err.count("\n")) == (2, "", True, 1), err
