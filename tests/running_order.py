"""The order in which workers take the test files: long ones early, and not all at once.

Workers take file after file. One that began a long file last would go on alone, and where all wait
for other processes at the same time, nobody computes. So files that wait, files that compute for
long and all others take turns, until only short ones are left for the end.
"""

from collections.abc import Sequence
from itertools import zip_longest

import pytest

WAITING = {"browser", "own_timeouts", "pty"}
"""Marks of what mostly waits for other processes."""

_WAITING_NAMES = {"Branch", "commands_started", "subprocess", "threading", "time"}
"""Who imports one of these waits for another process, a thread or the time."""

COSTS_S = {
    "bus_kinds_faults": 12,
    "seeing_camera_motion": 10,
    "world_run": 10,
    "api_running": 9,
    "page_chromium": 8,
    "report": 8,
    "closed_loop": 7,
    "compare": 7,
    "docs_commands": 7,
    "hands": 6,
    "human_head": 6,
    "run": 6,
    "seeing_faces": 6,
    "sweep": 10,
    "two_heads": 6,
    "api": 5,
    "behaviours": 5,
    "cli_calibrate_face": 5,
    "examples": 5,
    "gaze_on_films": 5,
    "human_saccades": 5,
    "outside_bus": 5,
    "page_process": 5,
    "run_films": 5,
    "six_joint_runs": 5,
    "true_motion": 5,
    "ways_out": 5,
    "architecture": 4,
    "camera_process": 4,
    "elsewhere": 4,
    "face_auto": 4,
    "habituation": 4,
    "lids": 4,
    "line_noise": 4,
    "page_layout": 4,
    "profiles": 4,
    "retune": 4,
    "run_refused": 4,
    "servo_faults": 4,
    "tutorial": 4,
    "world_shapes": 4,
}
"""Processor time of the files that take most of it, which ``pytest --durations=0`` shows."""

_SLOW_S = 3.5
"""Cost of a file with a test that is marked as slow, if it is not in the table."""


def spread(items: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Have files that wait, costly ones and all others take turns; costly ones by their costs."""
    files: dict[str, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.nodeid.partition("::")[0], []).append(item)
    waiting, costly, others = [], [], []
    for file, tests in files.items():
        cost_s = _cost_s(file, tests)
        if any(waits(item) for item in tests):
            waiting.append((cost_s, tests))
        elif cost_s:
            costly.append((cost_s, tests))
        else:
            others.append((cost_s, tests))
    by_cost = [sorted(some, key=lambda one: -one[0]) for some in (waiting, costly, others)]
    nothing: tuple[float, list[pytest.Item]] = (0.0, [])
    turns = zip_longest(*by_cost, fillvalue=nothing)
    return [item for turn in turns for _, tests in turn for item in tests]


def waits(item: pytest.Item) -> bool:
    """Return whether a test mostly waits rather than computes."""
    names = vars(getattr(item, "module", object)).keys()
    return bool(_marks(item) & WAITING or _WAITING_NAMES & names)


def _cost_s(file: str, tests: Sequence[pytest.Item]) -> float:
    name = file.rpartition("/")[2].removeprefix("test_").removesuffix(".py")
    slow = any("slow" in _marks(item) for item in tests)
    return COSTS_S.get(name, _SLOW_S if slow else 0.0)


def _marks(item: pytest.Item) -> set[str]:
    return {mark.name for mark in item.iter_markers()}
