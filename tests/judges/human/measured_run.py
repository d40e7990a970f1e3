"""Runs of the product in simulated time, from the shipped scene to measured joints.

The rig ``desk`` with byte-true emulated servos goes through the whole loop; what it did is kept as
columns, in memory, once for each process. ``tests/judges/human/row_*.py`` measure on it.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import inf, nan
from typing import Any, NamedTuple, cast

import numpy as np
import pytest

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.gaze.angles import add, scale, sub, yaw_pitch
from gazerig.gaze.types import body_name
from gazerig.robot.loop.tick import Tick, cyclopean_direction
from gazerig.robot.model.commands import Value
from gazerig.robot.recording.export_csv import GazeExport
from gazerig.robot.run import surroundings
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run_rig import with_options
from gazerig.sim_mock.scenes.scene import Scene

pytest.importorskip("gazerig.features.lab")  # its measures
from gazerig.features.lab.report.gaze_trace import GazeTrace  # noqa: E402
from gazerig.features.lab.simulated_run import simulate  # noqa: E402

BEGIN_S = 3.0
"""So long the guard lets the joints start slowly: rows of what a joint does at its best speed,
or at rest, begin after it."""

_EYES = ("left_eye_pan", "left_eye_tilt"), ("right_eye_pan", "right_eye_tilt")
_NECK = ("neck_yaw", "neck_pitch", "neck_roll")
_LONGEST_EXTRAPOLATED_S = 0.3


@dataclass(frozen=True)
class MeasuredRun:
    """One run as columns of n ticks; degrees, yaw + left, pitch + up, roll + right ear down.

    t_s: (n,) seconds since the run's beginning
    gaze_deg: (n, 2) measured gaze in space, the mean of both eyes on the head
    eyes_deg: (n, 2) measured mean of both eyes in the head
    eyes_goal_deg: (n, 2, 2) left and right eye in the head, as commanded, after the guard
    head_deg, head_goal_deg: (n, 3) yaw, pitch, roll of the neck, measured; as commanded
    plan_deg: (n, 2) direction of the planned gaze point from the head
    lids_goal: (n, 2) planned opening of left and right upper lid, 0 shut .. 1 open
    phase: (n,) "fixate", "saccade" or "pursue", as planned; blink: (n,) whether a blink lasts
    saccades, blinks: (n,) number of those planned until then
    target_m: (n, 3) the target's position at the tick; target_deg: (n, 2) direction from the head
    shift: (n,) counts up with each newly chosen target
    target_name: (n,) such as "face 3"; part: (n,) face part or ""
    truth: positions that the scene held, (n, 3) by "face 0", "hand 0" (of person 0), "thing 7";
        nan where there is none
    head_m: (n, 3) position of the midpoint of the eyes in the world
    clock_s: (n,) time of the scene; turn: (n,) reported state of conversation
    export: what tables are made of; trace: what the report is made of (both of the whole run)
    """

    t_s: np.ndarray
    clock_s: np.ndarray
    turn: np.ndarray
    gaze_deg: np.ndarray
    eyes_deg: np.ndarray
    head_deg: np.ndarray
    eyes_goal_deg: np.ndarray
    head_goal_deg: np.ndarray
    plan_deg: np.ndarray
    lids_goal: np.ndarray
    phase: np.ndarray
    blink: np.ndarray
    saccades: np.ndarray
    blinks: np.ndarray
    target_m: np.ndarray
    target_deg: np.ndarray
    shift: np.ndarray
    target_name: np.ndarray
    part: np.ndarray
    head_m: np.ndarray
    truth: dict[str, np.ndarray]
    export: GazeExport
    trace: GazeTrace

    @property
    def period_s(self) -> float:
        """Return the time from tick to tick."""
        return float(np.median(np.diff(self.t_s)))

    def truth_deg(self, name: str) -> np.ndarray:
        """Return the direction of something in the scene from the head, (n, 2)."""
        x, y, z = (self.truth[name] - self.head_m).T
        return np.degrees(np.column_stack((np.arctan2(y, x), np.arctan2(z, np.hypot(x, y)))))

    def later(self, begin_s: float) -> "MeasuredRun":
        """Return the run with the columns from a time on."""
        first = int(np.searchsorted(self.t_s, begin_s))
        arrays = [(k, v) for k, v in vars(self).items() if isinstance(v, np.ndarray)]
        columns: dict[str, Any] = {name: value[first:] for name, value in arrays}
        truth = {name: place[first:] for name, place in self.truth.items()}
        return replace(self, truth=truth, **columns)


Figures = dict[str, Any]
"""What a row measures, by name."""

_kept: dict[str, MeasuredRun] = {}


def measured_run(
    scene: str | Scene,
    profile: str = "robot",
    seed: int = 0,
    seconds: float = 60.0,
    overrides: Mapping[str, Value] | None = None,
    begin_s: float = 0.0,
    **options: Any,
) -> MeasuredRun:
    """Return a run's columns; the same arguments are run once for each process.

    Args:
        scene: a shipped scene's name, or a scene of the test's own with a name that no other has.
        profile: style of gaze.
        seed: of all random generators.
        seconds: length of the run.
        overrides: values of the rig's keys by dotted name, e.g. {"gaze.pursuit.gain": 0.9}.
        begin_s: so much is left out of the columns.
        options: further fields of RunOptions, e.g. conversation="talk".
    """
    name = scene if isinstance(scene, str) else scene.name
    key = repr(
        (name, profile, seed, seconds, sorted((overrides or {}).items()), sorted(options.items()))
    )
    if key not in _kept:
        with _scenes(scene):
            _kept[key] = _run(name, profile, seed, seconds, overrides or {}, options)
    return _kept[key].later(begin_s) if begin_s else _kept[key]


class Runs(NamedTuple):
    """The seconds and the seeds of the runs that a row measures."""

    seconds: float
    seeds: range

    def __call__(
        self, scene: str | Scene, least_s: float = 0.0, most_s: float = inf, **options: Any
    ) -> list[MeasuredRun]:
        """Return a run for each seed; options are those of ``measured_run``."""
        seconds = min(max(self.seconds, least_s), most_s)
        return [measured_run(scene, seed=seed, seconds=seconds, **options) for seed in self.seeds]

    def one(self, scene: str | Scene, number: int) -> MeasuredRun:
        """Return the run of one of the seeds."""
        return measured_run(scene, seed=self.seeds[number], seconds=self.seconds)

    @property
    def first(self) -> "Runs":
        """Return the runs of the first seed alone."""
        return self._replace(seeds=self.seeds[:1])


def half_rate_run(scene: str, profile: str, seconds: float) -> MeasuredRun:
    """Return a run on servos without bytes, of 100 ticks a second, in a quarter of the time."""
    return measured_run(
        scene, profile, seconds=seconds, overrides={"loop.rate_hz": 100.0}, bus="ideal"
    )


@contextmanager
def _scenes(scene: str | Scene) -> Any:
    """Have a scene of a test's own among those that a run can be put into."""
    shipped: Any = surroundings.load_scene
    if not isinstance(scene, str):
        one: Any = scene
        surroundings.load_scene = cast(
            Any, lambda name, seed=0: one if name == one.name else shipped(name, seed)
        )
    try:
        yield
    finally:
        surroundings.load_scene = shipped


def _run(
    scene: str,
    profile: str,
    seed: int,
    seconds: float,
    overrides: Mapping[str, Value],
    more: Mapping[str, Any],
) -> MeasuredRun:
    options = replace(
        RunOptions(True, True, seed, scene, profile=profile, seconds=seconds, bus="emulated"),
        **more,
    ).check_and_complete()
    rig = apply_changes(
        with_options(load_rig(options.rig, options.character, options.profile), options), overrides
    )
    columns, held = _Columns(), surroundings.load_scene(scene, seed)
    made = simulate(rig, options, watch=columns.update)
    return columns.gathered(held, made.trace)


class _Columns:
    """Gathers ticks as columns, by the names of ``MeasuredRun``; angles in rad as yet."""

    def __init__(self) -> None:
        self._rows: defaultdict[str, list[Any]] = defaultdict(list)
        self._export = GazeExport()
        self._start_s: float | None = None

    def update(self, tick: Tick) -> None:
        self._export.update(tick)
        if self._start_s is None:
            self._start_s = tick.t_s
        pose, target, gaze = tick.pose, tick.target, tick.gaze
        at = tick.guard_result.joints.index
        measured, commanded = tick.joints.position_rad, tick.guard_result.command_rad
        since_s = min(max(0.0, tick.t_s - target.at_s), _LONGEST_EXTRAPOLATED_S)
        point = add(target.p_world_m, scale(target.v_world_m_s, since_s))
        row = {
            "t_s": tick.t_s - self._start_s,
            "clock_s": tick.t_s,
            "turn": tick.conversation.state,
            "gaze_deg": yaw_pitch(cyclopean_direction(tick)),
            "eyes_deg": np.mean((pose.eye_left_rad, pose.eye_right_rad), axis=0),
            "eyes_goal_deg": [[commanded[at(name)] for name in eye] for eye in _EYES],
            "head_deg": [measured[at(name)] for name in _NECK],
            "head_goal_deg": [commanded[at(name)] for name in _NECK],
            "plan_deg": yaw_pitch(sub(gaze.gaze_point_world_m, pose.p_world_head_m)),
            "lids_goal": (gaze.lid_left, gaze.lid_right),
            "phase": gaze.phase,
            "blink": gaze.blink,
            "saccades": gaze.saccades,
            "blinks": gaze.blinks,
            "shift": target.shift,
            "target_m": point,
            "target_deg": yaw_pitch(sub(point, pose.p_world_head_m)),
            "target_name": body_name(target.kind, target.id),
            "part": target.part or "",
            "head_m": pose.p_world_head_m,
        }
        for name, value in row.items():
            self._rows[name].append(value)

    def gathered(self, scene: Scene, trace: GazeTrace) -> MeasuredRun:
        columns: dict[str, Any] = {name: np.array(rows) for name, rows in self._rows.items()}
        for name in [name for name in columns if name.endswith("_deg")]:
            columns[name] = np.degrees(columns[name])
        return MeasuredRun(
            truth=_truth(scene, columns["clock_s"].tolist()),
            export=self._export,
            trace=trace,
            **columns,
        )


def _truth(scene: Scene, times_s: Sequence[float]) -> dict[str, np.ndarray]:
    """Return what a scene held at these times of the clock."""
    out: defaultdict[str, np.ndarray] = defaultdict(lambda: np.full((len(times_s), 3), nan))
    for row, t_s in enumerate(times_s):
        for number, person in enumerate(scene.people(t_s)):
            out[f"face {number}"][row] = person.p_world_face_m
            if person.hand is not None:
                out[f"hand {number}"][row] = person.hand
        for thing in scene.things(t_s):
            out[f"thing {thing.id}"][row] = thing.p_world_m
    return dict(out)
