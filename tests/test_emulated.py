"""Devices as descriptions: sent to another process, and built from it."""

import pickle
from dataclasses import replace

import pytest

from gazerig.config.schema import load_rig
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.model.mass_params import LinkMassParams, MassParams
from gazerig.sim_mock.devices import (
    DynamixelLine,
    Emulated,
    FeetechLine,
    MaestroLine,
    build,
)
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

BUILT = ServoSpec(7, "xl330-m288", 1000, 45, Physics(stop_low_steps=900.0))
LINES: list[Emulated] = [
    DynamixelLine((BUILT, ServoSpec(1, "xc330-m288")), 57_600),
    FeetechLine((ServoSpec(253, "sts3215", 5, physics=Physics(load_nm=0.1)),)),
    MaestroLine(24, True, (HobbySpec(3, 4000.0),)),
    MaestroLine(),
]
KINDS = pytest.mark.parametrize("line", LINES, ids=[line.kind for line in LINES])


def test_the_servos_of_a_rig_can_be_sent():
    heavy = MassParams(head=LinkMassParams(mass_kg=0.9))
    (line,) = emulated_lines(replace(load_rig("desk"), mass=heavy)).values()
    assert pickle.loads(pickle.dumps(line)) == line


def test_a_baud_rate_that_the_servos_do_not_have_is_refused():
    with pytest.raises(ValueError, match="baud 12"):
        build(FeetechLine((ServoSpec(1, "sts3215"),), 12), lambda: 0.0)


@KINDS
def test_what_is_built_heeds_its_rate(line):
    device = build(line, lambda: 0.0)
    assert device.check_baud is (line.baud is not None)
    assert device.understands_baud(line.baud or 115_200)
    assert len(device.positions_steps()) == len(line.servos) or line.kind == "maestro"


def test_the_dice_of_faults_are_an_argument():
    def noisy(seed):
        device = build(LINES[1], lambda: 0.0, seed)
        device.faults.command("corrupt all")
        return device.exchange(bytes.fromhex("FFFFFD0201FF"))[0].pieces

    assert noisy(1) == noisy(1)
    assert any(noisy(seed) != noisy(1) for seed in range(2, 6))
