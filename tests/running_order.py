"""The order in which workers take the test files: long ones early, and not all at once.

Workers take file after file. One that began a long file last would go on alone, and where all wait
for other processes at the same time, nobody computes. So files that wait, files that compute for
long and all others take turns, until only short ones are left for the end.
"""

from collections.abc import Mapping, Sequence
from itertools import zip_longest

import pytest

WAITING = {"browser", "own_timeouts", "pty"}
"""Marks of what mostly waits for other processes."""

_WAITING_NAMES = {"Branch", "commands_started", "subprocess", "threading", "time"}
"""Who imports one of these waits for another process, a thread or the time."""

COSTS_S = {
    "programs": 18,
    "api_running": 13,
    "bus_kinds_faults": 12,
    "camera_calibration": 12,
    "report": 12,
    "docs_commands": 11,
    "docs_live": 10,
    "features_apart": 9,
    "human_head": 8,
    "opponent": 8,
    "seeing_camera_motion": 8,
    "study_design": 8,
    "world_run": 8,
    "camera_health": 7,
    "compare": 7,
    "run": 7,
    "behaviours": 6,
    "bus_kinds": 6,
    "cli_calibrate_face": 6,
    "page_chromium": 6,
    "page_layout": 6,
    "rerun": 6,
    "seeing_faces": 6,
    "sweep": 6,
    "true_motion": 6,
    "ways_out": 6,
    "gazerig": 5,
    "architecture": 5,
    "cli_bringup": 5,
    "closed_loop": 5,
    "human_reaction": 5,
    "human_saccades": 5,
    "light_start": 5,
    "outside_bus": 5,
    "profiles": 5,
    "retune": 5,
    "study_power": 5,
    "study_report": 5,
    "tutorial": 5,
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


def leave_out(name: str, files: Mapping[str, dict[str, bool]]) -> None:
    """Mark a test as done in the queue of pytest-xdist, which else runs it in the next worker."""
    for tests in files.values():
        if name in tests:
            tests[name] = True


def _cost_s(file: str, tests: Sequence[pytest.Item]) -> float:
    name = file.rpartition("/")[2].removeprefix("test_").removesuffix(".py")
    slow = any("slow" in _marks(item) for item in tests)
    return COSTS_S.get(name, _SLOW_S if slow else 0.0)


def _marks(item: pytest.Item) -> set[str]:
    return {mark.name for mark in item.iter_markers()}
