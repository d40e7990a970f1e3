"""Faults of the emulated servos of a rig that runs in another terminal: gazerig ctl fault."""

from collections.abc import Callable, Iterator

import pytest
from ticked_rig import TickedRig, connected, gazerig

from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.robot.run.requests import REAL
from gazerig.sim_mock.device_spec import line_of
from gazerig.sim_mock.devices import build


@pytest.fixture
def rig(monkeypatch) -> Iterator[TickedRig]:
    yield from connected(monkeypatch)


def with_faults(rig: TickedRig, fault: Callable[[str], str] | None) -> None:
    rig.made.bus = rig.made.bus._replace(inject_fault=fault)


def test_a_command_reaches_the_emulated_servos_and_says_what_it_did(rig):
    assert "xl330-m077" in SERVOS
    device = build(line_of("1-2:xl330-m077", 57600), lambda: 0.0)
    with_faults(rig, device.faults.command)
    assert not device.faults.has_any
    said = gazerig("ctl", "fault", "lose", "2", "count", "3")
    assert device.faults.has_any and "servo 2" in said
    assert "usage: lose" in gazerig("ctl", "fault", "lose", "many")
    assert "turn ID STEPS" in gazerig("ctl", "fault", "help")
    gazerig("ctl", "fault", "turn", "2", "-30")  # a negative number is no option
    assert device.positions_steps()[1] == pytest.approx(2048 - 30)


def test_the_servos_of_a_run_obey(rig):
    assert "servo 1 does not answer" in gazerig("ctl", "fault", "lose", "1", "count", "3")


def test_real_servos_take_none(rig):
    with_faults(rig, None)
    assert REAL in gazerig("ctl", "fault", "lose", "2")
