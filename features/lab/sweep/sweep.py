"""Runs at points times seeds on all processors; each is written to the disk when it ends."""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import gazerig
from gazerig.config.parameters import plain
from gazerig.config.rig import Rig
from gazerig.config.save_text import gestures_text, params_text, walk_text
from gazerig.features.lab.sweep.axes import Axis, Point
from gazerig.features.lab.sweep.outcome import Outcome
from gazerig.features.lab.sweep.run_store import RunStore, run_store
from gazerig.features.lab.sweep.worker_pool import Job, Simulation, WorkerPool, processors
from gazerig.robot.app.options import RunOptions

Progress = Callable[[int, int], None]
"""Receives the number of finished runs, and of all runs."""


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
    def arguments(self) -> dict[str, object]:
        """Return all of it, and the version, as JSON values."""
        options = {
            key: held for key, held in asdict(self.options).items() if held not in (None, "")
        }
        scanpath = self.rig.gaze.scanpath
        return {
            "gazerig": gazerig.__version__,
            "options": {**options, "seed": None},
            "set": {
                axis.key: f"{axis.low:g}:{axis.high:g}" if axis.is_range else list(axis.values)
                for axis in self.axes
            },
            "seeds": list(self.seeds),
            "search": dict(self.search),
            "rig": plain(self.rig),
            "walk": walk_text(scanpath.transition_matrix),
            "gestures": gestures_text(self.rig.gesture_files),
        }

    @property
    def job(self) -> Job:
        """Return the input of its worker processes."""
        return Job(self.options, params_text(self.rig))


class Sweep:
    """Runs points; runs that are already in the folder are not repeated.

    Args:
        seeds: of the runs at each point.
        store: finished runs.
        pool: runs the others.
    """

    def __init__(self, seeds: Sequence[int], store: RunStore, pool: WorkerPool) -> None:
        self._seeds, self._store, self._pool = tuple(seeds), store, pool

    def run(self, points: Sequence[Point], progress: Progress) -> list[Outcome]:
        """Return the outcomes in the order of points and seeds.

        The outcome of a process that died is not stored, so it is tried again the next time.

        Raises:
            SweepInterrupted: the user requested the end.
            SetupError: a run cannot be written, or no process started.
        """
        wanted: list[Simulation] = [(point, seed) for point in points for seed in self._seeds]
        found = [self._store.get(*one) for one in wanted]
        missing = [i for i, outcome in enumerate(found) if outcome is None]
        done = len(wanted) - len(missing)
        progress(done, len(wanted))
        for number, outcome in self._pool.outcomes([wanted[i] for i in missing]):
            found[missing[number]] = outcome
            if not outcome.died:
                self._store.add(outcome)
            done += 1
            progress(done, len(wanted))
        return [outcome for outcome in found if outcome is not None]


@contextlib.contextmanager
def open_sweep(
    spec: SweepSpec, folder: Path, jobs: int | None, stopped: Callable[[], str | None]
) -> Iterator[Sweep]:
    """Yield the sweep with its open store and its processes.

    Args:
        spec: everything that affects the runs.
        folder: folder of the runs.
        jobs: number of processes; None: one per processor.
        stopped: returns why to end, None to continue.

    Raises:
        SetupError: the folder holds something else, or cannot be written.
    """
    with (
        run_store(folder, spec.arguments) as store,
        WorkerPool(spec.job, jobs or processors(), stopped) as pool,
    ):
        yield Sweep(spec.seeds, store, pool)
