"""Conversation beside people: looks away by role, begin and end of turns, latencies.

``python tests/lab/bench_conversation.py [MODEL_MINUTES [RIG_MINUTES]]`` prints the measures of
the model alone and of the whole product, for six seeds. docs/measurements/conversation.md has
the results.
"""

import sys
from pathlib import Path
from typing import get_args

sys.path.insert(0, str(Path(__file__).parent))

from reported_turns import Script, model_alone, whole_product

from gazerig.features.lab.report.statistics import measured_value
from gazerig.features.lab.report.turns import Role, TurnLooks, TurnTrace, measures
from gazerig.robot.analysis.human_norms import BY_KEY

SEEDS = range(6)


def show(name: str, role: Script, runs: list[TurnTrace]) -> None:
    """Print each measure of a role: lowest and highest of the seeds, and the people's range."""
    each = [{one.key: one for one in measures(run)} for run in runs]
    keys = [key for key in each[0] if key.endswith(role) or key.startswith("turn_")]
    for key in keys:
        values = [measured_value(one[key].statistic, one[key].rows) for one in each]
        events = sum(one[key].events for one in each)
        band = BY_KEY[key]
        print(
            f"{name:8} {role:12} {key:20} {min(values):8.3f} .. {max(values):8.3f}  "
            f"n {events:5d}  {band.low:g}..{band.high:g}"
        )
    if role != "interrupted":
        found = [TurnLooks(run).directions(role) for run in runs]
        shares = (
            f"{way} {sum(one.count(way) for one in found) / sum(map(len, found)):.2f}"
            for way in ("side", "up", "down")
        )
        print(f"{name:8} {role:12} {', '.join(shares)}")


def main() -> None:
    """Measure both."""
    model_min, rig_min = (*map(float, sys.argv[1:]), *(96.0, 10.0)[len(sys.argv) - 1 :])
    for role in get_args(Role):
        show("model", role, [model_alone(role, seed, model_min) for seed in SEEDS])
    for script in get_args(Script):
        show("product", script, [whole_product(script, seed, rig_min) for seed in SEEDS])


if __name__ == "__main__":
    main()
