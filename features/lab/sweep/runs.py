"""Runs of a sweep, on all processors of this machine or on the workers of a Dask scheduler."""

import csv
import io
import json
import multiprocessing
import os
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import replace
from math import isfinite
from multiprocessing.synchronize import Event
from threading import Thread

from gazerig.config.parameters import apply_changes
from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.errors import Error
from gazerig.features.lab.report.measures import judge_run
from gazerig.features.lab.report.statistics import VerdictWord
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.lab.sweep.points import Point
from gazerig.robot.run.options import RunOptions

Row = dict[str, float | int | str | None]
"""One run: its parameters, seed, failure, measures with verdicts, and the summary's figures."""

FAILED = "failed"
_COUNTED: tuple[VerdictWord, ...] = ("outside", "pass", "too few events", "not judged")
_NOT_REPRODUCED = "wall_seconds"
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
"""Runs are distributed over the processors: threads of one would only wait for each other."""
_LOOK_S = 0.2
_NICE = 5
_ANSWERS_S = 10.0

_ending: Event | None = None
"""Set in a worker process of this machine: whether the sweep ends."""


@contextmanager
def open_executor(jobs: int | None, scheduler: str | None) -> Iterator[Executor]:
    """Yield worker processes of this machine, or those of a scheduler.

    Args:
        jobs: Number of processes; None: one per processor.
        scheduler: Address of a Dask scheduler, tcp://HOST:PORT; None: this machine. It gives the
            run of a worker that is lost to another one.

    Raises:
        SetupError: Dask is not installed, or no scheduler with workers is at the address.
    """
    if scheduler is None:
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
        context = multiprocessing.get_context("spawn")
        ending = context.Event()
        count = jobs or len(os.sched_getaffinity(0))
        with ProcessPoolExecutor(count, context, _start_worker, (ending,)) as pool:
            try:
                yield pool
            finally:
                ending.set()
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise SetupError(extra_hint("distributed", "cluster", error)) from error
    try:
        client = Client(scheduler, timeout=_ANSWERS_S)
    except (OSError, ValueError) as error:
        raise SetupError(
            f"--scheduler {scheduler}: no Dask scheduler answers ({error}): start dask scheduler"
        ) from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise SetupError(
                f"--scheduler {scheduler}: has no workers: start dask worker {scheduler} --nthreads 1"
            )
        with client.get_executor() as executor:
            yield executor


def run_all(
    executor: Executor,
    rig: Rig,
    options: RunOptions,
    runs: Sequence[tuple[Point, int]],
    stopped: Callable[[], str | None],
    progress: Callable[[int], None],
) -> list[Row]:
    """Run points with seeds; return the rows of the finished runs in their order.

    Args:
        executor: Runs them.
        rig: The rig before any point is applied.
        options: Options of all runs except the seed.
        runs: Point and seed of each.
        stopped: Returns why to end early, None to continue.
        progress: Receives the number of finished runs.
    """
    futures: list[Future[Row]] = [
        executor.submit(run_row, rig, replace(options, seed=seed), point) for point, seed in runs
    ]
    pending = set(futures)
    while pending and stopped() is None:
        _, pending = wait(pending, _LOOK_S, FIRST_COMPLETED)
        progress(len(futures) - len(pending))
    for future in pending:
        future.cancel()
    return [
        _finished_row(future, *run)
        for future, run in zip(futures, runs, strict=True)
        if future not in pending
    ]


def run_row(rig: Rig, options: RunOptions, point: Point) -> Row:
    """Simulate one run; return its row, which has the reason if it failed."""
    row = _start_row(point, options.seed)
    ending = _ending
    try:
        figures, trace = simulate(
            apply_changes(rig, point), options,
            lambda: "the sweep ends" if ending is not None and ending.is_set() else None,
        )  # fmt: skip
    except Exception as error:
        return row | {FAILED: _error_text(error)}
    results = judge_run(trace, intervals=False)
    counts = Counter(result.verdict for result in results)
    row |= {f"report.{word.replace(' ', '_')}": counts[word] for word in _COUNTED}
    for result in results:
        row[f"report.{result.band.key}"] = result.value if isfinite(result.value) else None
        row[f"verdict.{result.band.key}"] = result.verdict
    return row | dict(_flat({k: v for k, v in figures.items() if k != _NOT_REPRODUCED}))


def table_text(rows: Sequence[Row]) -> str:
    """Return rows as CSV; a cell that a row lacks is empty."""
    text = io.StringIO()
    names = dict.fromkeys(name for row in rows for name in row)
    table = csv.DictWriter(text, names, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def _start_worker(ending: Event) -> None:
    """Prepare a process: Ctrl-C is the program's, and no process outlives the program."""
    global _ending
    _ending = ending
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICE)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        os._exit(1)

    Thread(target=end_with_parent, daemon=True).start()


def _start_row(point: Point, seed: int) -> Row:
    row: Row = {
        key: value if isinstance(value, int | float | str) else json.dumps(value)
        for key, value in point.items()
    }
    return row | {"seed": seed, FAILED: ""}


def _finished_row(future: Future[Row], point: Point, seed: int) -> Row:
    error = future.exception()
    if error is None:
        return future.result()
    return _start_row(point, seed) | {FAILED: _error_text(error)}


def _error_text(error: BaseException) -> str:
    text = "; ".join(map(str.strip, str(error).splitlines()))
    return text if isinstance(error, Error) and text else f"{type(error).__name__}: {text}"


def _flat(figures: Mapping[str, object], above: str = "") -> Iterator[tuple[str, str | float]]:
    """Yield nested figures as columns with dotted names; for a list, its length."""
    for name, value in figures.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{name}.")
        elif isinstance(value, list | tuple):
            yield f"{above}{name}", len(value)
        elif value is not None:
            yield f"{above}{name}", value if isinstance(value, int | float) else str(value)
