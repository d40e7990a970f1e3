"""Servos for the doctor to examine, well ones and others."""

from math import pi

import pytest

from gazerig.drivers.feetech.memory_table import REGISTERS
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.examination import apply_fixes, examine_bus
from gazerig.features.bringup.servo_kinds import DYNAMIXEL, FEETECH
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.safety.start_range import far_outside
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

BAUD = 1_000_000
RANGES = ((1, 1650, 2446, "left_eye_pan"), (2, 1650, 2446, "left_eye_tilt"),
          (7, 1252, 2844, "neck_yaw"))  # fmt: skip
EYE = {"dynamixel": "xl330-m077", "feetech": "sts3215"}
NECK = {"dynamixel": "xc330-m288", "feetech": "sts3215"}
SPEED = {"dynamixel": 6000.0, "feetech": 3000.0}
PAN, TILT, YAW = "left_eye_pan (servo 1)", "left_eye_tilt (servo 2)", "neck_yaw (servo 7)"
each = pytest.mark.parametrize("kind", [DYNAMIXEL, FEETECH], ids=lambda kind: kind.name)


def setups_of(kind):
    return tuple(
        ServoConfig(i, (NECK if i == 7 else EYE)[kind.name], low, high,
                   2000.0 if i == 7 else SPEED[kind.name], name)
        for i, low, high, name in RANGES
    )  # fmt: skip


class Rig:
    """Three servos in this process, set as the rig wants them; some may be spoilt."""

    def __init__(self, kind, specs=None):
        self.kind, self.setups, self.now_s = kind, setups_of(kind), 10.0
        specs = specs or [ServoSpec(s.id, s.model, 2048) for s in self.setups]
        build = build_feetech if kind is FEETECH else build_dynamixel
        self.chain = build(specs, lambda: self.now_s, baud=BAUD)
        self.port = InProcessPort(self.chain)
        self.port.setBaudRate(BAUD)
        self.reported = []
        for setup in self.setups:
            if any(spec.id == setup.id for spec in specs):
                self.set(setup.id, return_delay_time=0, min_position_limit=setup.min_steps,
                         max_position_limit=setup.max_steps)  # fmt: skip

    def set(self, servo_id, **values):
        servo = self.chain[servo_id]
        if self.kind is DYNAMIXEL:
            for name, value in values.items():
                servo.memory.set(name, value)
        else:
            servo.write(55, b"\0")
            for name, value in values.items():
                servo.write(REGISTERS[name].address, REGISTERS[name].encode(value))
            servo.write(55, bytes((values.get("lock", 1),)))
        self.pass_time()
        self.chain.refresh()

    def hold(self, servo_id):
        self.chain[servo_id].write(64 if self.kind is DYNAMIXEL else 40, b"\x01")

    def get(self, servo_id, name):
        return Transactions(self.port, self.kind.family).read(servo_id, name)

    def command(self, text):
        self.port.faults.command(text)
        self.pass_time()

    def pass_time(self, seconds=0.1):
        self.now_s += seconds
        self.chain.positions_steps()

    def check(self):
        self.reported.clear()
        return examine_bus(
            self.port, self.kind, self.setups, BAUD, self.reported.append, self.find_far
        )

    def find_far(self, steps):
        """Judge by the same rule as a run, for joints whose range is that of their servos."""
        found = {}
        for setup in self.setups:
            low, high = ((s - 2048) * pi / 2048 for s in (setup.min_steps, setup.max_steps))
            if setup.name in steps:
                angle = (steps[setup.name] - 2048) * pi / 2048
                found[setup.name] = far_outside(angle, JointLimit(low, high, 1.0, 1.0))
        return {name: text for name, text in found.items() if text}

    def fix(self, findings):
        tell = self.reported.append
        return list(apply_fixes(self.port, self.kind, self.setups, BAUD, findings, tell))


def one(findings, level, where, words):
    """Return the finding of this level at this place with these words."""
    named = [f for f in findings if f.level == level and f.where == where and words in f.what]
    assert len(named) == 1, [str(f) for f in findings]
    return named[0]
