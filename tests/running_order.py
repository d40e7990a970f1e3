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

COSTS_S = {
    "seeing_camera_motion": 16,
    "bus_kinds_faults": 14,
    "world_run": 12,
    "report": 11,
    "compare": 10,
    "closed_loop": 9,
    "docs_commands": 9,
    "hands": 9,
    "profiles": 9,
    "human_head": 8,
    "run": 8,
    "seeing_faces": 8,
    "retune": 7,
    "api": 6,
    "behaviours": 6,
    "description": 6,
    "examples": 6,
    "human_saccades": 6,
    "sweep": 6,
    "true_motion": 6,
    "face_auto": 5,
    "human_pursuit": 5,
    "line_noise": 5,
    "rerun": 5,
    "six_joint_runs": 5,
    "sweep_fit": 5,
    "tutorial": 5,
    "eye_tracker": 4,
    "gesture_moments": 4,
    "habituation": 4,
    "lids": 4,
    "motion_room": 4,
    "other_rigs": 4,
    "pixel_camera": 4,
    "servo_faults": 4,
    "several_people": 4,
    "world_people": 4,
    "world_room": 4,
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
        if any(_marks(item) & WAITING for item in tests):
            waiting.append((cost_s, tests))
        elif cost_s:
            costly.append((cost_s, tests))
        else:
            others.append((cost_s, tests))
    by_cost = [sorted(some, key=lambda one: -one[0]) for some in (waiting, costly, others)]
    nothing: tuple[float, list[pytest.Item]] = (0.0, [])
    turns = zip_longest(*by_cost, fillvalue=nothing)
    return [item for turn in turns for _, tests in turn for item in tests]


def _cost_s(file: str, tests: Sequence[pytest.Item]) -> float:
    name = file.rpartition("/")[2].removeprefix("test_").removesuffix(".py")
    slow = any("slow" in _marks(item) for item in tests)
    return COSTS_S.get(name, _SLOW_S if slow else 0.0)


def _marks(item: pytest.Item) -> set[str]:
    return {mark.name for mark in item.iter_markers()}
