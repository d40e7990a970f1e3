"""Runs at points times seeds on all processors; each is written to the disk when it ends.

In the folder of a sweep, ``arguments.json`` contains everything that affects the runs, and
``runs.jsonl`` one line for each finished run. A second sweep with the same arguments continues an
interrupted one.
"""

import contextlib
import fcntl
import json
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import BinaryIO

import gazerig
from gazerig.config.parameters import to_plain
from gazerig.config.rig import Rig
from gazerig.config.save_text import params_text, tracks_text
from gazerig.config.schema import load_walk
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.lab.sweep.axes import Axis, Point
from gazerig.features.lab.sweep.run_outcome import Outcome
from gazerig.features.lab.sweep.worker_pool import Job, Simulation, WorkerPool, processors
from gazerig.robot.app.options import RunOptions

Progress = Callable[[int, int], None]
"""Receives the number of finished runs, and of all runs."""

ARGUMENTS, RUNS = "arguments.json", "runs.jsonl"
_SHOWN = 4

Arguments = Mapping[str, object]
"""Name -> JSON value; nested mappings are compared key by key."""


class RunStore:
    """Finished runs on the disk, by point and seed."""

    def __init__(self, folder: Path, file: BinaryIO) -> None:
        self.folder, self._file = folder, file
        self._found = dict[str, Outcome]()
        self._file.seek(0)
        whole = 0
        for line in self._file:
            try:
                point, seed, figures, failed = json.loads(line)
            except ValueError:
                break
            whole += len(line)
            self._found[_key(point, seed)] = Outcome(point, seed, figures, failed)
        self._file.truncate(whole)

    def __len__(self) -> int:
        return len(self._found)

    def get(self, point: Point, seed: int) -> Outcome | None:
        """Return a finished run, None if there is none."""
        return self._found.get(_key(point, seed))

    def add(self, outcome: Outcome) -> None:
        """Write a finished run."""
        self._found[_key(outcome.point, outcome.seed)] = outcome
        # No fsync for each run: a power loss may lose runs, an end of the program does not.
        self._file.write(json.dumps(list(outcome[:4])).encode() + b"\n")
        self._file.flush()


@contextlib.contextmanager
def run_store(folder: Path, arguments: Arguments) -> Iterator[RunStore]:
    """Open the folder of a sweep, a new one or one with the same arguments.

    Raises:
        SetupError: the folder contains a sweep with other arguments or other files, another program
            writes in it, or it cannot be written.
    """
    make_folder(folder)
    path = folder / ARGUMENTS
    text = json.dumps(arguments, indent=1) + "\n"
    if path.exists():
        try:
            then = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise SetupError(f"{path} is not readable ({error}): give another --out") from None
        if not isinstance(then, dict):
            raise SetupError(f"{path} is no sweep's: give another --out")
        if found := list(_differences(then, json.loads(text))):
            more = f"; {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
            raise SetupError(
                f"{folder} holds a sweep with other arguments: {'; '.join(found[:_SHOWN])}{more}; "
                "repeat those, or give another folder with --out"
            )
    elif any(folder.iterdir()):
        raise SetupError(f"{folder} holds other files: give an empty folder with --out")
    try:
        file = (folder / RUNS).open("a+b")
    except OSError as error:
        raise SetupError(f"cannot write {folder / RUNS} ({error.strerror})") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SetupError(
                f"another gazerig sweep writes in {folder}: give another --out"
            ) from None
        if not path.exists():
            write_file(path, text)
        yield RunStore(folder, file)


def _differences(then: object, now: object, key: str = "") -> Iterator[str]:
    """Yield the differences of two JSON values, as text."""
    if isinstance(then, dict) and isinstance(now, dict):
        for name in {**then, **now}:
            below = f"{key}.{name}" if key else str(name)
            yield from _differences(then.get(name), now.get(name), below)
    elif then != now:
        yield f"{key} was {reprlib.repr(then)}, is now {reprlib.repr(now)}"


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
            "rig": to_plain(self.rig),
            "walk": params_text(load_walk(scanpath.transition_matrix)),
            "tracks": tracks_text(self.rig.track_files),
        }

    @property
    def job(self) -> Job:
        """Return the input of its worker processes."""
        return Job(self.options, params_text(self.rig))


class Sweep:
    """Runs points; runs that are already in the folder are not repeated."""

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
            if not outcome.has_died:
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
