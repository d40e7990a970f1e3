"""Output of a run on the terminal: little, plain, and nothing about missing parts."""

import signal
from types import SimpleNamespace
from typing import Any

import pytest

from gazerig.robot.cli.command_list import Commands
from gazerig.robot.cli.run import has_desktop, report_faults
from gazerig.robot.cli.terminal import exit_on_signals
from gazerig.robot.dashboard.feed.status_line import StatusLine

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
def test_a_browser_is_opened_only_where_somebody_sees_it(environ, terminal, opens):
    assert has_desktop(environ, terminal) is opens


def test_a_fault_of_many_joints_is_told_once():
    said: list[str] = []
    stale = {"stale joints": 3}
    figures = {"joint_faults": dict.fromkeys("abcdefghi", stale), "stopped_by": "seconds"}
    assert report_faults(figures, said.append)
    assert said == ["the run had faults: 9 joints stale joints (3 times)"]


def test_the_list_of_commands_is_that_of_their_modules():
    listed = Commands()
    for name, entry in listed.entries.items():
        command = listed[name]
        assert command.name == name and command.rich_help_panel == entry.panel
        first = " ".join(command.help.split("\n\n")[0].split())
        assert entry.summary == first, f"{name}: mend cli/command_list.py"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_request_to_end_while_a_run_is_made_ends_it_in_order(number):
    before = signal.signal(number, signal.SIG_DFL)
    tidied = False
    try:
        with pytest.raises(SystemExit) as end, exit_on_signals():
            try:
                signal.raise_signal(number)
            finally:
                tidied = True
        assert (end.value.code, tidied) == (128 + number, True)
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, before)


def test_the_status_line_shows_the_loop_and_the_bus_five_times_a_second(running):
    figures: Any = SimpleNamespace(over_s=2.0, rate_hz=99.5, late_share=0.0)
    lines: list[str] = []
    line = StatusLine(lines.append, running.made.robot.body.bus.health, lambda: figures)
    for tick in running.ticks:
        line.update(tick)
    assert len(lines) == 5 and " 99.5 Hz | " in lines[-1] and "| bus ok" in lines[-1]
