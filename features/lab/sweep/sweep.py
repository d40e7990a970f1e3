"""Runs at points times seeds on all processors."""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gazerig.config.rig import Rig
from gazerig.config.save_text import params_text
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder
from gazerig.features.lab.sweep.axes import Axis, Point
from gazerig.features.lab.sweep.run_outcome import Outcome
from gazerig.features.lab.sweep.worker_pool import Job, Simulation, WorkerPool, processors
from gazerig.robot.app.options import RunOptions

Progress = Callable[[int, int], None]
"""Receives the number of finished runs, and of all runs."""


def new_folder(folder: Path) -> None:
    """Make the folder of a sweep.

    Raises:
        SetupError: it holds other files, or cannot be written.
    """
    make_folder(folder)
    if any(folder.iterdir()):
        raise SetupError(f"{folder} holds other files: give an empty folder with --out")


def _key(point: Point, seed: int) -> str:
    return json.dumps([point, seed])


@dataclass(frozen=True)
class SweepSpec:
    """Everything that affects the runs of a sweep.

    Attributes:
        rig: rig before any point is applied, from the options' files.
        options: options of all runs except the seed.
        axes: the varied parameters.
        seeds: seeds of the runs at each point.
        search: choice of the points, e.g. {"samples": 50}; {} for a grid.
    """

    rig: Rig
    options: RunOptions
    axes: tuple[Axis, ...]
    seeds: tuple[int, ...]
    search: Mapping[str, object]

    @property
    def job(self) -> Job:
        """Return the input of its worker processes."""
        return Job(self.options, params_text(self.rig))


class Sweep:
    """Runs points; a run that has been made is not repeated."""

    def __init__(self, seeds: Sequence[int], pool: WorkerPool) -> None:
        self._seeds, self._pool = tuple(seeds), pool
        self._found = dict[str, Outcome]()

    @property
    def finished(self) -> list[Outcome]:
        """Return all outcomes as yet, in the order of their ends."""
        return list(self._found.values())

    def run(self, points: Sequence[Point], progress: Progress) -> list[Outcome]:
        """Return the outcomes in the order of points and seeds.

        Raises:
            SweepInterrupted: the user requested the end.
            SetupError: no process started.
        """
        wanted: list[Simulation] = [(point, seed) for point in points for seed in self._seeds]
        missing = [one for one in wanted if _key(*one) not in self._found]
        done = len(wanted) - len(missing)
        progress(done, len(wanted))
        for _, outcome in self._pool.outcomes(missing):
            self._found[_key(outcome.point, outcome.seed)] = outcome
            done += 1
            progress(done, len(wanted))
        return [self._found[_key(*one)] for one in wanted]


@contextlib.contextmanager
def open_sweep(
    spec: SweepSpec, folder: Path, jobs: int | None, stopped: Callable[[], str | None]
) -> Iterator[Sweep]:
    """Yield the sweep with its new folder and its processes.

    Args:
        spec: everything that affects the runs.
        folder: folder of its files.
        jobs: number of processes; None: one per processor.
        stopped: returns why to end, None to continue.

    Raises:
        SetupError: the folder holds something else, or cannot be written.
    """
    new_folder(folder)
    with WorkerPool(spec.job, jobs or processors(), stopped) as pool:
        yield Sweep(spec.seeds, pool)
