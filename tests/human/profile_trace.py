"""Functions of the gaze models that run in a profile, compared with docs/gaze.md."""

import re
from collections import Counter
from collections.abc import Iterator
from cProfile import Profile
from functools import cache
from math import atan2, pi
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple, cast

import pytest
from fakes.scenes import EmptyScene

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.robot.run import run_rig
from gazerig.robot.run.options import RunOptions
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing

pytest.importorskip("gazerig.features.lab")  # its measures
from gazerig.features.lab.simulated_run import simulate  # noqa: E402

PAGE = Path(__file__).parents[2] / "docs" / "gaze.md"
PROFILES = ("robot", "mitake", "nakamoto")
SECONDS = 20.0
_ROW = re.compile(
    r"^\| (?P<paper>[^|]+) \| (?P<what>[^|]+) \| `(?P<name>[^`|]+)` \| (?P<cells>.+) \|$"
)


class EverythingOnce(EmptyScene):
    """A person who comes, walks 37 deg aside, waves and goes; then a hand that moves past."""

    name = "everything-once"
    round_s = SECONDS

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the person, who goes at 10 s."""
        if t_s > 10.0:
            return ()
        aside = min(1.0, max(0.0, t_s - 5.0))
        face = (1.0 - 0.2 * aside, 0.6 * aside, 0.24 + 0.1 * aside)
        swing = 0.12 * (1.0 if int(t_s * 3.0) % 2 else -1.0)
        hand = (face[0] - 0.12, face[1] - 0.3 + swing, face[2]) if 7.0 < t_s < 9.0 else None
        return (ScenePerson(face, (pi + atan2(face[1], face[0]), 0.0), hand),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return a hand that comes in when the person has gone."""
        if not 10.5 < t_s < 11.5:
            return ()
        return (Thing(9, "hand", (0.9, 0.5 - 0.2 * (t_s - 10.5), 0.2), 0.05),)


class Claim(NamedTuple):
    """A row of the page: paper and item, function, and whether it runs in each profile."""

    paper: str
    what: str
    name: str
    cells: tuple[str, ...]


def rows() -> list[str]:
    """Return the lines of the page's section about profiles."""
    text = PAGE.read_text(encoding="utf-8")
    return text.partition("\n## Profiles\n")[2].partition("\n## ")[0].splitlines()


def claims() -> Iterator[Claim]:
    """Yield the rows of the page's tables."""
    for line in rows():
        if found := _ROW.match(line):
            cells = tuple(cell.strip() for cell in found["cells"].split("|"))
            yield Claim(found["paper"], found["what"], found["name"], cells)


class Trace(NamedTuple):
    """Record of a run: calls of functions of gaze/ by qualified name, kinds of its targets."""

    calls: Counter[str]
    kinds: frozenset[str]


@cache
def ran(profile: str, scanpath: str | None = None, seconds: float = SECONDS) -> Trace:
    """Return what runs in a profile, and what it looks at."""
    calls, kinds = Profile(subcalls=False, builtins=False), set[str]()
    scene = EverythingOnce()
    shipped = run_rig.load_scene
    options = RunOptions(
        True, True, 0, scene.name, profile=profile, scanpath=scanpath, seconds=seconds, bus="ideal"
    )
    rig = apply_changes(load_rig("desk", profile=profile), {"loop.rate_hz": 50.0})
    run_rig.load_scene = cast(Any, lambda name, seed: scene)
    calls.enable()
    try:
        simulate(rig, options, watch=lambda tick: kinds.add(tick.target.kind))
    finally:
        calls.disable()
        run_rig.load_scene = shipped
    named: Counter[str] = Counter()
    for code, times, *_ in calls.getstats():
        if isinstance(code, CodeType) and "gaze" in Path(code.co_filename).parts:
            named[code.co_qualname] += times
    return Trace(named, frozenset(kinds))


def as_told(claim: Claim) -> list[str]:
    """Return the profiles of which a row of the page is not true."""
    return [
        profile
        for profile, cell in zip(PROFILES, claim.cells, strict=True)
        if cell != ("runs" if ran(profile).calls[claim.name] else "-")
    ]
