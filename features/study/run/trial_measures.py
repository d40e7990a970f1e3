"""Measures of presentations on the head, from the recordings of its runs.

The participant is the nearest person. The detectors decide from the face and eyes whether the
participant looks at the head (``Face.looks_at_head``); times of uncertainty do not count.
"""

from collections.abc import Callable, Sequence
from math import degrees, isfinite, nan
from pathlib import Path

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.features.lab.report import report
from gazerig.features.lab.report.gaze_trace import GazeTraceBuilder
from gazerig.features.lab.report.statistics import judge
from gazerig.features.study.journal import (
    STEP_DEG,
    Record,
    TrialBegan,
    TrialEnded,
    TrialMeasured,
)
from gazerig.features.study.run.study_file import LoadedStudy
from gazerig.features.study.scores import GAZE_MEASURES
from gazerig.gaze.angles import add, norm, scale, sub
from gazerig.robot.analysis.gaze_on_face import gaze_point_on_face
from gazerig.robot.analysis.human_norms import BY_KEY
from gazerig.robot.analysis.mutual_gaze import HALF_HIGH_M, HALF_WIDE_M
from gazerig.robot.analysis.summary import cyclopean_direction
from gazerig.robot.control.tick import Tick
from gazerig.robot.recording.read import RunRecording, report_bad_contents

SWITCH_S = 0.5
"""Time before and after a switch in which steps of the joints belong to it, seconds."""


def measure_presentations(
    study: LoadedStudy, records: Sequence[Record], folder: Path, say: Callable[[str], None]
) -> tuple[TrialMeasured, ...]:
    """Return the measures of presentations that have none yet.

    Args:
        study: the study with its objective measures.
        records: of the participant.
        folder: folder of the participant, with the recordings.
        say: receives a line about a recording that cannot be read, which has no measures.
    """
    began = {
        (one.trial, one.attempt, one.side): one for one in records if isinstance(one, TrialBegan)
    }
    done = {(one.trial, one.attempt, one.side) for one in records if isinstance(one, TrialMeasured)}
    wanted = [
        one
        for one in records
        if isinstance(one, TrialEnded) and one.recording and isfinite(one.from_s)
        and (one.trial, one.attempt, one.side) not in done
    ]  # fmt: skip
    found = []
    for name in dict.fromkeys(one.recording for one in wanted):
        ends = [one for one in wanted if one.recording == name]
        try:
            with report_bad_contents(folder / name):
                # The ticks of each presentation and those shortly before it, in one pass.
                runs: list[list[Tick]] = [[] for _ in ends]
                for tick in RunRecording(folder / name).ticks():
                    for end, mine in zip(ends, runs, strict=True):
                        if end.from_s - SWITCH_S <= tick.t_s <= end.to_s:
                            mine.append(tick)
        except SetupError as error:
            say(str(error))
            continue
        for end, ticks in zip(ends, runs, strict=True):
            condition = began[end.trial, end.attempt, end.side].condition
            values = _values(study.design.objective, ticks, end.from_s)
            found.append(TrialMeasured(end.trial, condition, values, end.side, end.attempt))
    return tuple(found)


def _values(names: Sequence[str], ticks: Sequence[Tick], from_s: float) -> dict[str, float]:
    """Return the measures of one presentation by name."""
    shown = [tick for tick in ticks if tick.t_s >= from_s]
    values = {STEP_DEG: largest_step_deg(ticks, from_s)}
    if any(name in GAZE_MEASURES for name in names):
        gaze = participant_gaze_measures(shown, from_s)
        values |= {name: gaze[name] for name in names if name in gaze}
    if others := [name for name in names if name not in GAZE_MEASURES]:
        building = GazeTraceBuilder()
        for tick in shown:
            building.update(tick)
        of_run = {one.key: one for one in report.measure_run(building.trace())} if shown else {}
        for name in others:
            one = of_run.get(name)
            values[name] = nan if one is None else judge(one, BY_KEY[name]).value
    return values


def largest_step_deg(ticks: Sequence[Tick], from_s: float) -> float:
    """Return the largest step of a joint's goal between ticks around a switch, degrees."""
    near = [tick for tick in ticks if abs(tick.t_s - from_s) <= SWITCH_S]
    if len(near) < 2:
        return nan
    goals = np.array([tick.guard_result.command_rad for tick in near])
    return degrees(float(np.abs(np.diff(goals, axis=0)).max()))


def participant_gaze_measures(ticks: Sequence[Tick], from_s: float) -> dict[str, float]:
    """Return the measures of GAZE_MEASURES as shares of the time with a visible face.

    They are nan if no face was visible, or its gaze was never known.
    """
    known = looks = both = 0
    first_s = nan
    for tick in ticks:
        if tick.percept is None or not tick.percept.faces:
            continue
        head_m = tick.pose.p_world_head_m
        away_m = [norm(sub(face.p_world_m, head_m)) for face in tick.percept.faces]
        face = tick.percept.faces[away_m.index(min(away_m))]
        if face.looks_at_head is None:
            continue
        known += 1
        if face.looks_at_head:
            looks += 1
            elapsed_s = max(0.0, tick.t_s - tick.percept.captured_s)
            p_m = add(face.p_world_m, scale(face.v_world_m_s, elapsed_s))
            point = gaze_point_on_face(head_m, cyclopean_direction(tick), p_m, face.R_world_face)
            if point is not None:  # inside the oval of the face
                both += (point[0] / HALF_WIDE_M) ** 2 + (point[1] / HALF_HIGH_M) ** 2 <= 1.0
            first_s = first_s if isfinite(first_s) else tick.t_s - from_s
    share = 1.0 / known if known else nan
    return {
        "mutual_gaze_share": both * share,
        "participant_gaze_share": looks * share,
        "first_look_s": first_s,
    }
