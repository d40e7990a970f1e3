"""Devices as descriptions: sent to another process, and built from it."""

import pickle
from dataclasses import replace

from gazerig.config.schema import load_rig
from gazerig.robot.model.weight import HeadMassParams, MassParams
from gazerig.robot.run.emulated import emulated_lines


def test_the_servos_of_a_rig_can_be_sent():
    heavy = MassParams(head=HeadMassParams(mass_kg=0.9))
    (line,) = emulated_lines(replace(load_rig("desk"), mass=heavy)).values()
    assert pickle.loads(pickle.dumps(line)) == line
