"""Gaze around turns beside people, in the report and in the export for eye-tracking tools."""

from typing import get_args

import pytest
from reported_turns import model_alone

from gazerig.features.lab.analysis.human_norms import BY_KEY
from gazerig.features.lab.report.statistics import judge_without_interval
from gazerig.features.lab.report.turns import Role, measures

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.mark.parametrize("role", get_args(Role))
def test_looks_away_have_the_share_rate_and_direction_of_people(role: Role) -> None:
    for one in measures(model_alone(role, 1, 20.0, 0.05)):
        if one.key.endswith(role) or (one.key in ("turn_begins", "turn_ends") and len(one.rows)):
            assert judge_without_interval(one, BY_KEY[one.key]).verdict == "pass", one.key
