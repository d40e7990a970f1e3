"""Each paper's profile is its paper and nothing else, proved by running it (docs/gaze.md)."""

import re
from collections import Counter
from cProfile import Profile
from functools import cache
from math import atan2, degrees, pi, radians
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple, cast

import numpy as np
import pytest
from fakes.scenes import EmptyScene
from human.measured_run import half_rate_run, measured_run
from human.row_03_rests import visits

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between, direction
from gazerig.robot.run import surroundings
from gazerig.robot.run.options import RunOptions
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing

pytest.importorskip("gazerig.features.lab")  # its measures
from gazerig.features.lab.simulated_run import simulate  # noqa: E402

PAGE = Path(__file__).parents[3] / "docs" / "gaze.md"
PROFILES = ("robot", "mitake", "nakamoto")
SECONDS = 17.0
_ROW = re.compile(
    r"^\| (?P<paper>[^|]+) \| (?P<what>[^|]+) \| `(?P<name>[^`|]+)` \| (?P<cells>.+) \|$"
)


class EverythingOnce(EmptyScene):
    """A person who comes, walks 37 deg aside, waves and goes; then a hand that moves past."""

    name = "everything-once"
    round_s = SECONDS

    def people(self, t_s):
        """Return the person, who goes at 10 s."""
        if t_s > 10.0:
            return ()
        aside = min(1.0, max(0.0, t_s - 5.0))
        face = (1.0 - 0.2 * aside, 0.6 * aside, 0.24 + 0.1 * aside)
        swing = 0.12 * (1.0 if int(t_s * 3.0) % 2 else -1.0)
        hand = (face[0] - 0.12, face[1] - 0.3 + swing, face[2]) if 7.0 < t_s < 9.0 else None
        return (ScenePerson(face, (pi + atan2(face[1], face[0]), 0.0), hand),)

    def things(self, t_s):
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


def rows():
    """Return the lines of the page's section about profiles."""
    text = PAGE.read_text(encoding="utf-8")
    return text.partition("\n## Profiles\n")[2].partition("\n## ")[0].splitlines()


def claims():
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
def ran(profile, scanpath=None, seconds=SECONDS):
    """Return what runs in a profile, and what it looks at."""
    calls, kinds = Profile(subcalls=False, builtins=False), set[str]()
    scene = EverythingOnce()
    shipped = surroundings.load_scene
    options = RunOptions(
        True, True, 0, scene.name, profile=profile, scanpath=scanpath, seconds=seconds, bus="ideal"
    )
    rig = apply_changes(load_rig("desk", profile=profile), {"loop.rate_hz": 50.0})
    surroundings.load_scene = cast(Any, lambda name, seed: scene)
    calls.enable()
    try:
        simulate(rig, options, watch=lambda tick: kinds.add(tick.target.kind))
    finally:
        calls.disable()
        surroundings.load_scene = shipped
    named: Counter[str] = Counter()
    for code, times, *_ in calls.getstats():
        if isinstance(code, CodeType) and "gaze" in Path(code.co_filename).parts:
            named[code.co_qualname] += times
    return Trace(named, frozenset(kinds))


CLAIMS = list(claims())
"""Nothing here is asked of single ticks."""


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.name)
def test_e68_what_the_page_says_runs_where_it_says(claim):
    for profile, cell in zip(PROFILES, claim.cells, strict=True):
        assert cell == ("runs" if ran(profile).calls[claim.name] else "-"), profile


def test_every_row_of_the_page_is_read():
    written = [line for line in rows() if line.startswith("| ") and "`" in line]
    assert len(CLAIMS) == len(written) >= 30
    # Every function of it runs somewhere: none is a name that has gone.
    assert all(any(ran(profile).calls[claim.name] for profile in PROFILES) for claim in CLAIMS)


@pytest.mark.parametrize(
    ("scanpath", "function"),
    [("simple", "SimpleCycle.step"), ("face_tracking", "FaceTracking.step"),
     ("random", "RandomAngles.step")],
)  # fmt: skip
def test_e68_the_baselines_of_the_paper_run_in_its_profile(scanpath, function):
    calls = ran("nakamoto", scanpath, 6.0).calls
    assert calls[function] > 200 and calls["MarkovWalk.step"] == 0
    assert calls["OppositeAngles.fixate"] > 200


def test_e68_each_profile_looks_at_what_its_paper_has():
    assert ran("nakamoto").kinds == {"face", "rest"}
    assert ran("mitake").kinds == {"face", "hand", "rest"}
    assert ran("robot").kinds >= {"face", "hand", "away", "search"}


@pytest.fixture(scope="module")
def nakamoto():
    return half_rate_run("face-to-face", "nakamoto", seconds=25.0)


def test_e68_nakamoto_walks_as_its_table_with_no_look_away(nakamoto):
    found = visits(nakamoto)
    assert 1.0 / np.mean([visit.seconds for visit in found]) == pytest.approx(3.69, rel=0.12)
    assert min(visit.rest_s for visit in found) < 0.06  # no floor
    found_s = 0.2  # until then nobody is seen
    assert set(nakamoto.target_name[nakamoto.t_s > found_s]) == {"face 1"}
    assert np.abs(nakamoto.eyes_goal_deg).max() <= 20.0 + 1e-6


def test_e68_nakamoto_turns_the_head_beyond_20_deg_only(nakamoto):
    moves = np.abs(np.diff(nakamoto.head_goal_deg[:, 0])) > 0.02
    begins = np.flatnonzero(moves[1:] & ~moves[:-1]) + 1
    begins = begins[np.diff(begins, prepend=-400) > 300]  # a movement may be planned again
    aside = np.hypot(*(nakamoto.target_deg - nakamoto.head_deg[:, :2])[begins].T)
    assert len(begins) >= 2 and aside.min() > 19.0


def test_e68_mitake_never_blinks_nor_leaves_a_face_that_stands():
    run = half_rate_run("face-to-face", "mitake", seconds=6.0)
    assert not run.blink.any() and np.ptp(run.lids_goal) == 0.0
    assert set(run.part) <= {"N", ""} and (run.part == "N").mean() > 0.8
    assert not any("away" in name for name in run.target_name)


class Aside(EmptyScene):
    """A person 30 deg to the left, who does not move, as high as the robot's eyes."""

    name = "aside"

    def people(self, t_s):
        return (ScenePerson((0.866, 0.5, 0.125), (radians(-150.0), 0.0), None),)


@pytest.mark.parametrize(("salience", "short"), [(0.4, 29.121), (0.6, 15.0), (0.8, 0.879)])
def test_e12_offset_values_of_the_running_head(salience, short):
    rules = {
        "gaze.top_down.rules.wait.salience": salience, "loop.rate_hz": 50.0
    }  # fmt: skip
    run = measured_run(Aside(), "mitake", seconds=4.0, overrides=rules, bus="ideal")
    yaw, pitch = np.radians(run.head_goal_deg[-1, :2])
    rest = angle_between(direction((yaw, pitch)), direction((radians(30.0), 0.0)))
    assert degrees(rest) == pytest.approx(short, abs=0.1)
