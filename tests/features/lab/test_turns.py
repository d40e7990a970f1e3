"""Gaze around turns beside people, in the report and in the export for eye-tracking tools."""

from itertools import cycle
from math import degrees
from typing import Any, get_args

import numpy as np
import pytest
from gaze_targets import target

from gazerig.features.lab.report.gaze_trace import ROW, STATES, GazeTrace
from gazerig.features.lab.report.statistics import judge
from gazerig.features.lab.report.turns import Role, measures
from gazerig.gaze.angles import yaw_pitch
from gazerig.gaze.attention.conversation import (
    AversionParams,
    ConversationGaze,
    ConversationParams,
)
from gazerig.gaze.types import TurnState

SCRIPTS: dict[Role, tuple[tuple[TurnState, float], ...]] = {
    "speaking": (("listening", 1.0), ("thinking", 0.75), ("speaking", 40.0)),
    "listening": (("listening", 40.0),),
    "dialogue": (("listening", 3.1), ("thinking", 0.7), ("speaking", 3.6)),
}
"""States and their seconds, again and again: monologues, the partner's, and turns of both."""


def model_alone(role: Role) -> GazeTrace:
    """Return 20 minutes of looks away and turns, without a robot, before a face at 1 m."""
    random = [np.random.default_rng((1, n)) for n in range(3)]
    attention: Any = type("Unused", (), {"converse": lambda *of: None, "search": None})()
    params = AversionParams(), ConversationParams()
    gaze = ConversationGaze("people", *params, attention, *random[:2])
    face = target(salience=1.0, top_down=True)
    script, rests_s, end_s, number, rows = cycle(SCRIPTS[role]), 0.0, 0.0, 0, []
    for t_s in np.arange(0.0, 1200.0, 0.05).tolist():
        if t_s >= end_s:
            state, lasts_s = next(script)
            end_s, number = t_s + lasts_s, number + 1
            gaze.enter(state, 1, end_s if state == "speaking" else None, 0.9, t_s)
        gaze.step(t_s)
        look = gaze.look(face, (0.0, 0.0, 0.0), t_s, False, rests_s)
        if t_s > rests_s:
            rests_s = t_s + float(random[2].exponential(0.3))  # looks at parts of the face
        yaw, pitch = yaw_pitch(look.p_world_m)
        rows.append((t_s, STATES.index(state), number, degrees(yaw), degrees(pitch)))
    table = np.zeros(len(rows), ROW)
    table["t"], table["turn"], table["turn_number"], *off = np.array(rows).T
    table["off_partner"] = np.column_stack(off)
    return GazeTrace(table)


@pytest.mark.parametrize("role", get_args(Role))
def test_looks_away_have_the_share_rate_and_direction_of_people(role):
    for one in measures(model_alone(role)):
        if one.key.endswith(role) or (one.key in ("turn_begins", "turn_ends") and len(one.rows)):
            assert judge(one, interval=False).verdict == "pass", one.key
