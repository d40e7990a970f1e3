"""Output of a run on the terminal: little, plain, and nothing about missing parts."""

import pytest

from gazerig.robot.cli.run import has_desktop, report_faults

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
):
    assert has_desktop(environ, terminal) is opens


def test_a_fault_of_many_joints_is_told_once():
    said: list[str] = []
    stale = {"stale joints": 3}
    figures = {"joint_faults": dict.fromkeys("abcdefghi", stale), "stopped_by": "seconds"}
    assert report_faults(figures, said.append)
    assert said == ["the run had faults: 9 joints stale joints (3 times)"]
