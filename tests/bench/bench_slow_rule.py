"""Lateness of ticks with a slow rule of attention: none, a sleeping and a computing rule.

    PYTHONPATH=. python tests/bench/bench_slow_rule.py [--seconds S]

The desk rig on emulated servos in another process, at its own rate in real time. Lateness is that
of a tick's begin against its slot. A rule that is always slow is dropped after five overruns; one
that is slow twice a second is not, and costs the loop time again and again.
"""

import argparse
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))
from outside_package import install, on_path

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.drivers.plugins import ATTENTION
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions

RULES = {
    "own attention": "",
    "a quick rule": "return (1.0, 0.2, 0.5)",
    "sleeps 20 ms": "time.sleep(0.02); return (1.0, 0.2, 0.5)",
    "computes 20 ms": "end = time.perf_counter() + 0.02\n        while time.perf_counter() < end: pass\n        return (1.0, 0.2, 0.5)",
    "computes 3 ms twice a second": """self.n = getattr(self, 'n', 0) + 1
        end = time.perf_counter() + 0.003 * (self.n % 100 == 0)
        while time.perf_counter() < end: pass
        return (1.0, 0.2, 0.5)""",
    "blocks for ever": "time.sleep(1e6)",
}


def lateness_s(rule: str, seconds: float) -> tuple[list[float], int, list[str]]:
    """Return the lateness of each tick, the missed slots and the messages."""
    rig = load_rig("desk")
    if rule:
        rig = apply_changes(rig, {"gaze.chooser": "slow"})
    made = assemble(rig, RunOptions(mock=True, seed=0, scene="visitor"))
    period_s, missed = 1.0 / rig.loop.rate_hz, 0
    late: list[float] = []
    said: list[str] = []
    made.robot.start(made.clock)
    start_s, slot, last_s = made.clock.now_s(), 0, made.clock.now_s()
    try:
        while slot * period_s < seconds:
            slot += 1
            made.clock.sleep_until(start_s + slot * period_s)
            now_s = made.clock.now_s()
            late.append(now_s - start_s - slot * period_s)
            said += made.robot.tick(now_s, now_s - last_s).events
            last_s = now_s
            over = int((made.clock.now_s() - start_s) / period_s) - slot
            missed, slot = missed + max(0, over), slot + max(0, over)
    finally:
        made.robot.stop()
        made.close()
    return late, missed, [line for line in said if "slow" in line]


def main() -> None:
    """Measure every rule and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    seconds = parser.parse_args().seconds
    table = Table("rule", "ticks", "median ms", "p99 ms", "worst ms", "slots missed", "said")
    for name, body in RULES.items():
        with TemporaryDirectory() as folder, on_path(Path(folder)):
            source = f"import time\nclass Rule:\n    def choose(self, percept, state, t_s):\n        {body or 'pass'}\n"
            install(
                Path(folder), "slow", {ATTENTION: {"slow": "slow_rule:Rule"}}, {"slow_rule": source}
            )
            began_s = time.monotonic()
            late, missed, said = lateness_s(body, seconds)
            assert time.monotonic() - began_s < 10.0 * seconds + 20.0
        ms = 1e3 * np.array(late)
        figures = [f"{np.percentile(ms, q):.2f}" for q in (50, 99, 100)]
        table.add_row(name, str(len(late)), *figures, str(missed), "; ".join(said) or "-")
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
