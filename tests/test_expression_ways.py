"""Expressions and levels from the command line, from Python and on the page."""

from collections.abc import Iterator

import pytest
from ticked_rig import TickedRig, connected, gazerig

from gazerig.robot.cli import animation
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.commands import SetLevel


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[TickedRig]:
    yield from connected(monkeypatch)


def test_an_expression_from_the_command_line(rig: TickedRig) -> None:
    assert "neutral, happy, sad, surprised" in gazerig("ctl", "express")
    assert "happy is active, strength 0.5" in gazerig(
        "ctl", "express", "happy", "--strength", "0.5"
    )
    assert rig.tick(200)["jaw"] == pytest.approx(3.0)
    assert "expression: happy (in force), neutral, sad" in gazerig("ctl", "ask", "expression")
    assert "available: neutral, happy, sad, surprised" in gazerig("ctl", "express", "glad")


def test_a_level_from_the_command_line_is_kept_up_and_let_go(
    rig: TickedRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "RealClock", SimulatedClock)
    assert gazerig("ctl", "level", "mouth", "0.7", "--seconds", "0.25") == ""
    assert rig.commands == [SetLevel("mouth", 0.7)] * 4 + [SetLevel("mouth", 0.0)]
    assert "'loud' is not a level: give a number 0..1" in gazerig("ctl", "level", "mouth", "loud")
    assert "no level 'ear'; available: mouth" in gazerig("ctl", "level", "ear", "1")
