"""Quality of the boxing match: python tests/bench/bench_boxing.py [--eyes EYE ...] [--seeds N]

One round (44 s of simulated time) a seed through each eye: ``scene``, the ideal detector on the
scene of points; ``drawn``, its drawn pictures before the real detectors; ``world``, the ideal
detector on the world with physics; ``rendered``, that world's rendered pictures before the real
detectors. For each of the paper's behaviours: events answered, median latency, share of their time
on what was asked for; and how the action planner did. Nothing here passes or fails.
"""

import argparse
import time
from collections.abc import Mapping
from statistics import fmean
from typing import Any

from gazerig.config.schema import load_rig
from gazerig.features.lab.simulated_run import simulate
from gazerig.robot.app.assemble import with_options
from gazerig.robot.app.options import RunOptions

ROUND_S = 44.1
EYES: Mapping[str, Mapping[str, Any]] = {
    "scene": {"scene": "boxing", "bus": "ideal"},
    "drawn": {"scene": "boxing", "bus": "ideal", "pixels": True},
    "world": {"world": "boxing", "no_pictures": True},
    "rendered": {"world": "boxing"},
}
BEHAVIOURS = ("punch", "attack", "wave", "reach", "return", "step", "face")
SUMMED = ("punches", "guards_in_time", "attacks", "open", "counters", "looked_at")


def rounds(eye: str, seeds: int) -> tuple[list[dict[str, Any]], float]:
    """Return the figures of one round a seed, and the processor time of one, s."""
    began_s, found = time.process_time(), []
    for seed in range(seeds):
        options = RunOptions(mock=True, fast=True, seed=seed, seconds=ROUND_S, **EYES[eye])
        found.append(simulate(with_options(load_rig("desk"), options), options).figures)
    return found, (time.process_time() - began_s) / seeds


def behaviour(name: str, runs: list[dict[str, Any]]) -> str:
    """Return one behaviour over all rounds: answered, latency, share."""
    each = [run["behaviours"][name] for run in runs if name in run["behaviours"]]
    if not each:
        return "-"
    latencies = [one["latency_s"] for one in each if one["latency_s"] is not None]
    shares = [one["share"] for one in each if one["share"] is not None]
    seen, of = (sum(one[key] for one in each) for key in ("seen", "of"))
    late = f"{fmean(latencies):.2f} s" if latencies else "-"
    return f"{seen} of {of}, {late}, {fmean(shares):.0%}"


def planner(runs: list[dict[str, Any]]) -> dict[str, str]:
    """Return how the planner did over all rounds."""
    each = [run["planner"] for run in runs if run.get("planner")]
    total = {key: sum(one[key] for one in each) for key in SUMMED}
    leads = [one["lead_ms"] for one in each if one["lead_ms"] is not None]
    false = fmean([one["false_guards_per_min"] for one in each])
    return {
        "guards in time": f"{total['guards_in_time']} of {total['punches']}",
        "before the fist, ms": f"{fmean(leads):.0f}" if leads else "-",
        "false guards a minute": f"{false:.1f}",
        "attacks": f"{total['attacks']}: {total['open']} open, {total['counters']} after a punch",
        "place looked at": f"{total['looked_at']} of {total['attacks']}",
    }


def main() -> None:
    """Measure and print a table in Markdown."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--eyes", nargs="+", choices=EYES, default=list(EYES))
    parser.add_argument("--seeds", type=int, default=2)
    args = parser.parse_args()
    columns = {}
    for eye in args.eyes:
        runs, processor_s = rounds(eye, args.seeds)
        columns[eye] = {name: behaviour(name, runs) for name in BEHAVIOURS}
        columns[eye] |= planner(runs) | {"processor, s a round": f"{processor_s:.0f}"}
    print(f"| | {' | '.join(args.eyes)} |\n|{'---|' * (1 + len(args.eyes))}")
    for name in columns[args.eyes[0]]:
        print(f"| {name} | {' | '.join(columns[eye][name] for eye in args.eyes)} |")


if __name__ == "__main__":
    main()
