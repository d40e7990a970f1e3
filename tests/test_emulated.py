"""Devices as descriptions: sent to another process, and built from it."""

import pickle
from dataclasses import replace

import pytest

from gazerig.config.schema import load_rig
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.model.mass_params import HeadMassParams, MassParams
from gazerig.sim_mock.devices import (
    FeetechLine,
    build,
)
from gazerig.sim_mock.smart_servo.physics import ServoSpec


def test_the_servos_of_a_rig_can_be_sent():
    heavy = MassParams(head=HeadMassParams(mass_kg=0.9))
    (line,) = emulated_lines(replace(load_rig("desk"), mass=heavy)).values()
    assert pickle.loads(pickle.dumps(line)) == line


def test_a_baud_rate_that_the_servos_do_not_have_is_refused():
    with pytest.raises(ValueError, match="baud 12"):
        build(FeetechLine((ServoSpec(1, "sts3215"),), 12), lambda: 0.0)
