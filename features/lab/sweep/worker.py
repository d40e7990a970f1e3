"""Process of a sweep: imports once, then simulates one run after the other.

The module gazerig.features.lab.sweep.worker_pool runs it as ``python -m
gazerig.features.lab.sweep.worker``. Standard input: a pickled ``Job``, then a line of JSON for each
run, [number, point, seed]. Standard output: a line of JSON for each, [number, figures, reason of a
failure]. It ends with its input, and during a run if its parent process has ended.
"""

import json
import os
import pickle
import sys
from collections.abc import Callable
from dataclasses import replace

from gazerig.config.parameters import apply_changes
from gazerig.config.rig import Rig
from gazerig.config.save_text import params_text
from gazerig.errors import Error
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.lab.sweep.axes import Point
from gazerig.features.lab.sweep.run_outcome import Column, run_figures
from gazerig.features.lab.sweep.worker_pool import Job
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_rig import run_rig

PARENT_GONE = "the program that started it has ended"
_NICE = 5


def figures_at(
    rig: Rig, options: RunOptions, point: Point, stopped: Callable[[], str | None]
) -> dict[str, Column]:
    """Run a rig with the values of a point; return the columns of its figures.

    Raises:
        ConfigError: a rule of the rig forbids the point.
        SetupError: the run cannot be started, or ended by a fault.
    """
    return run_figures(*simulate(apply_changes(rig, point), options, stopped))


def main() -> None:
    """Serve until the input ends."""
    os.nice(_NICE)
    parent = os.getppid()
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # a package may print text
    job: Job = pickle.load(sys.stdin.buffer)
    rig = run_rig(job.options)
    changed_meanwhile = params_text(rig) != job.config

    def stopped() -> str | None:
        return PARENT_GONE if os.getppid() != parent else None

    for line in sys.stdin.buffer:
        number, point, seed = json.loads(line)
        figures, failed = dict[str, Column](), ""
        try:
            if changed_meanwhile:
                raise Error(f"the files of {job.options.rig} changed while the sweep ran")
            figures = figures_at(rig, replace(job.options, seed=seed), point, stopped)
        except Exception as error:
            failed = error_text(error)
        if stopped() is not None:
            return
        print(json.dumps([number, figures, failed]), file=answers, flush=True)


def error_text(error: Exception) -> str:
    """Return the reason of a failed run as one line."""
    text = "; ".join(map(str.strip, str(error).splitlines()))
    expected = isinstance(error, Error)
    return text if expected and text else f"{type(error).__name__}: {text}"


if __name__ == "__main__":
    main()
