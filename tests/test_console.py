"""Output of a run on the terminal: little, plain, and nothing about missing parts."""

import pytest

from gazerig.robot.app import session
from gazerig.robot.app.options import RunOptions
from gazerig.robot.cli import browser
from gazerig.robot.cli.browser import has_desktop, open_page
from gazerig.robot.cli.run import report_faults, start_text
from gazerig.robot.control.event_text import is_register_change
from gazerig.robot.control.interrupts import Interrupts

DESK = {"DISPLAY": ":0"}


@pytest.mark.parametrize(
    ("environ", "terminal", "opens"),
    [
        (DESK, True, True),
        ({"WAYLAND_DISPLAY": "wayland-0"}, True, True),
        ({}, True, False),
        (DESK, False, False),
        ({**DESK, "CI": "true"}, True, False),
        ({**DESK, "SSH_CONNECTION": "10.0.0.2 1 10.0.0.3 22"}, True, False),
    ],
)
def test_a_browser_is_opened_only_where_somebody_sees_it(
    environ: dict[str, str], terminal: bool, opens: bool
) -> None:
    assert has_desktop(environ, terminal) is opens


def test_a_browser_that_fails_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def refuse(url: str) -> bool:
        asked.append(url)
        raise browser.webbrowser.Error("no browser")

    monkeypatch.setattr(browser.webbrowser, "open", refuse)
    browser._open("http://127.0.0.1:8080/?token=x")
    monkeypatch.setattr(browser.webbrowser, "open", asked.append)
    open_page("http://127.0.0.1:8081/?token=x")
    while len(asked) < 2:
        pass
    assert asked[1] == "http://127.0.0.1:8081/?token=x"


@pytest.mark.parametrize(
    ("event", "is_one"),
    [
        ("neck_yaw (servo 7): Max Position Limit 4095 -> 2844", True),
        ("servos 1-9: Indirect Addresses set", True),
        ("neck_yaw (servo 7): overheating", False),
        ("neck_yaw (servo 7) restarted: set up again", False),
        ("this computer is busy: 3 answers late in the last s", False),
    ],
)
def test_register_changes_are_told_from_what_happens(event: str, is_one: bool) -> None:
    assert is_register_change(event) is is_one


@pytest.mark.parametrize("verbose", [False, True])
def test_a_mock_begins_without_registers_and_tables(verbose: bool) -> None:
    said: list[str] = []
    options = RunOptions(
        mock=True, fast=True, profile="nakamoto", seconds=0.1, verbose=verbose
    ).check_and_complete()
    session.run(session.compose(options), Interrupts(signals=False), said.append)
    register = [line for line in said if "->" in line or "Indirect Addresses" in line]
    table = [line for line in said if "do not all sum to 1" in line]
    assert (len(register) > 10, len(table)) == ((True, 1) if verbose else (False, 0))
    if not verbose:
        assert said == ["stopped by seconds: parked, torque off"]


def test_the_first_line_says_what_happens_and_how_it_ends() -> None:
    mock = RunOptions(mock=True).check_and_complete()
    assert start_text(mock) == (
        "desk: emulated servos; it looks at a simulated scene, visitor. "
        "Ctrl-C parks the head and ends the run."
    )
    assert "its servos; it looks at a webcam" in start_text(
        RunOptions(camera=0).check_and_complete()
    )


def test_a_fault_of_many_joints_is_told_once() -> None:
    said: list[str] = []
    stale = {"stale joints": {"times": 3, "seconds": 1.6}}
    figures = {"joint_faults": dict.fromkeys("abcdefghi", stale), "stopped_by": "seconds"}
    assert report_faults(figures, said.append)
    assert said == ["the run had faults: 9 joints stale joints (1.6 s, 3 times)"]
    assert report_faults({**figures, "ticks": 900, "overruns": 300}, said.append)
    assert said[1] == f"{said[0]}; the computer was too busy: 25% of ticks came late"
