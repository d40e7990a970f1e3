"""Single reads and writes, with every fault that a single answer can have."""

import struct
from typing import Any

import pytest
from sts_rig import Rig as StsRig

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.protocol import instruction
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.servo_bus.family import Identity
from gazerig.drivers.servo_bus.settings import write_settings
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.dynamixel.packets import status
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec


class Rig:
    """Three servos in this process; ``spoil(answer)`` gives what arrives of one answer."""

    def __init__(self):
        self.now_s = 0.0
        specs = [ServoSpec(i, "xl330-m077", 2000 + i) for i in (1, 2, 3)]
        self.chain = build_dynamixel(specs, lambda: self.now_s)
        self.sent: list[Any] = []
        self.port = SpoiltPort(self.chain, self.sent.append, sleep_until=self.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.registers = Transactions(self.port, DYNAMIXEL)

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def read(self, name="present_position"):
        return self.registers.read(2, name)

    def command(self, text):
        self.chain.faults.command(text)


class SpoiltPort(InProcessPort):
    """A port whose answers are what ``spoil`` makes of them."""

    spoil = staticmethod(lambda raw: raw)

    def write(self, data):
        super().write(data)
        self._waiting = self.spoil(self._waiting)


@pytest.fixture
def rig():
    return Rig()


def resealed(raw, at, value):
    """Return a packet with one byte changed and a right CRC."""
    from fastcrc.crc16 import umts

    body = raw[:at] + bytes([value]) + raw[at + 1 : -2]
    return body + struct.pack("<H", umts(body))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda raw: b"",
        lambda raw: raw[1:],
        lambda raw: raw[:-1],
        lambda raw: raw[:5] + b"\x00" + raw[6:],
        lambda raw: raw[:5] + b"\xff\xff" + raw[7:],
        lambda raw: raw[:10] + bytes([raw[10] ^ 4]) + raw[11:],
        lambda raw: resealed(raw, 4, 3),
        lambda raw: status(2, 0, b"\x01\x02"),
        lambda raw: b"\xff\xff\x02\x06\x00\x00\x08\x00\x00\xef",
        lambda raw: instruction(2, 2, struct.pack("<HH", 132, 4)),
    ],
)
def test_no_good_answer(rig, spoil):
    rig.port.spoil = spoil
    assert rig.read() is None
    # Three tries, each after a while in which late answers pass.
    assert rig.now_s < 0.7
    del rig.port.spoil
    assert rig.read() == 2002


@pytest.mark.parametrize("late_ms", [40, 90])
@pytest.mark.parametrize("times", [1, 3])
def test_a_late_answer_is_never_that_of_another_register(rig, late_ms, times):
    pairs = [("profile_velocity", 111), ("goal_position", 2002), ("profile_acceleration", 77)]
    for name, value in pairs:
        assert rig.registers.write(2, name, value)
    for name, value in pairs * 3:
        rig.command(f"delay 2 {late_ms} count {times}")
        assert rig.read(name) in (value, None)
    rig.command("clear")
    rig.now_s += 1.0
    assert [rig.read(name) for name, _ in pairs] == [value for _, value in pairs]


def test_a_refusal_is_no_value_and_no_exception(rig):
    rig.port.spoil = lambda raw: status(2, 7, b"")
    assert rig.read() is None
    assert (rig.registers.refusal, len(rig.sent)) == (7, 1)  # it is an answer: nothing is repeated
    del rig.port.spoil
    assert rig.read() == 2002
    assert rig.registers.refusal == 0


def test_an_answer_with_an_alert_is_data(rig):
    rig.command("overload 2")
    assert rig.read() == 2002
    assert rig.registers.write(2, "led", 1)


# --- a family with a lock, and answers that echoes look like


@pytest.fixture
def sts():
    rig = StsRig([ServoSpec(4, "sts3215", 1928)], setups=[], baud=1_000_000)
    rig.port.setBaudRate(1_000_000)
    rig.registers = Transactions(rig.port, FEETECH)  # type: ignore[attr-defined]
    return rig


def test_registers_behind_a_lock(sts):
    registers = sts.registers
    assert registers.identify(4) == Identity(777, 353)
    assert registers.identify(5) is None and registers.read(5, "id") is None
    assert registers.read(4, "present_position") == 1928
    assert registers.write(4, "torque_limit", 600)
    assert registers.read(4, "torque_limit") == 600
    write_settings(registers, 4, {"position_offset": -85})
    sts.chain[4].restart()
    sts.now_s += 1.0
    assert registers.read(4, "position_offset") == -85
    assert registers.read(4, "lock") == 1


@pytest.mark.parametrize("fault", ["lose 4 count 2", "corrupt 4 40 count 2", "delay 4 60 count 1",
                                   "echo", "truncate 4 3 count 2"])  # fmt: skip
def test_faults_of_answers_with_a_check_of_one_byte(sts, fault):
    sts.command(fault)
    assert sts.registers.read(4, "present_position") == 1928
    sts.command(fault)
    assert sts.registers.write(4, "torque_limit", 321)
    assert sts.registers.read(4, "torque_limit") == 321
