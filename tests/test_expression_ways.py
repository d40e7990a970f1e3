"""Expressions and levels from the command line, from Python and on the page."""

from collections.abc import Iterator

import pytest
from ticked_rig import Outbox, TickedRig, connected, gazerig

from gazerig.robot.cli import animation
from gazerig.robot.dashboard.panels.controls import ExpressionPanel
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.commands import Express, SetLevel


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


def test_levels_come_from_standard_input(rig: TickedRig) -> None:
    assert gazerig("ctl", "level", "mouth", "-", typed="0.2\n\n1\n") == ""
    assert rig.commands == [SetLevel("mouth", v) for v in (0.2, 1.0, 0.0)]


def test_buttons_and_strength_on_the_page() -> None:
    outbox = Outbox()
    panel = ExpressionPanel(Widgets().panel("steer"), outbox)  # type: ignore[arg-type]
    panel.offer(["sad", "neutral", "happy"])
    panel.offer(["happy", "neutral", "sad"])
    expressions, strength = panel.expressions, panel.strength
    assert expressions is not None and strength is not None
    assert expressions.options == ("neutral", "happy", "sad")
    strength.receive_input(0.4, "5")
    expressions.receive_input("sad", "5")
    assert outbox.asked == [(Express("sad", 0.4), "5")]
