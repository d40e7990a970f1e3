"""Parallel processes that simulate one run at a time each.

A process that dies (killed for its memory, for example) loses its current run, and is replaced.
No process outlives the program: see gazerig.features.lab.sweep.worker.
"""

import contextlib
import json
import os
import pickle
import selectors
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from subprocess import PIPE
from typing import BinaryIO, NamedTuple, Self

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process import child_process
from gazerig.features.lab.sweep.axes import Point
from gazerig.features.lab.sweep.run_outcome import Figures, Outcome
from gazerig.robot.app.options import RunOptions

_MODULE = "gazerig.features.lab.sweep.worker"
_ONE_THREAD = {
    name: "1"
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_NUM_THREADS")
}
"""Runs are distributed over the processors; threads of one run would only wait for each other."""
_LOOK_S = 0.2
_END_S = 2.0

Simulation = tuple[Point, int]
"""A point and a seed."""


@dataclass(frozen=True)
class Job:
    """The common input of all runs.

    Attributes:
        options: options except the seed.
        config: the rig's configuration as read and checked by the program.
    """

    options: RunOptions
    config: str


class SweepInterrupted(Exception):
    """The user requested the end; finished runs are on the disk."""


class _Worker(NamedTuple):
    """A process and its standard error."""

    process: subprocess.Popen[bytes]
    stderr: BinaryIO

    def send(self, line: bytes) -> None:
        """Send bytes to its standard input; the next read reports a dead process."""
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(line)
            self.process.stdin.flush()

    @property
    def answers(self) -> BinaryIO:
        """Return its standard output."""
        assert self.process.stdout is not None
        return self.process.stdout  # type: ignore[return-value]

    def death(self) -> str:
        """Return the reason of its end."""
        code = self.process.wait()
        self.stderr.seek(0)
        lines = self.stderr.read().decode(errors="replace").strip().splitlines()
        how = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
        return f"its process ended ({how}){': ' + lines[-1] if lines else ''}"


class WorkerPool:
    """Worker processes, started with the first runs."""

    def __init__(self, job: Job, jobs: int, stopped: Callable[[], str | None]) -> None:
        self._job, self._jobs, self._stopped = pickle.dumps(job), jobs, stopped
        self._workers = list[_Worker]()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        """End all processes, even during a run: nothing moves in a simulation."""
        for worker in self._workers:
            worker.process.kill()
        for worker in self._workers:
            self._close(worker)
        self._workers.clear()

    @property
    def pids(self) -> list[int]:
        """Return the numbers of the processes."""
        return [worker.process.pid for worker in self._workers]

    def outcomes(self, runs: Sequence[Simulation]) -> Iterator[tuple[int, Outcome]]:
        """Run all; yield (index, outcome) as they finish, in any order.

        Raises:
            SweepInterrupted: ``stopped`` returned a reason.
            SetupError: no process can be started.
        """
        waiting = list(reversed(range(len(runs))))
        busy: dict[_Worker, int] = {}
        with selectors.DefaultSelector() as selector:
            while waiting or busy:
                if self._stopped() is not None:
                    raise SweepInterrupted
                while len(self._workers) < min(self._jobs, len(busy) + len(waiting)):
                    self._workers.append(self._start())
                idle = [worker for worker in self._workers if worker not in busy]
                for worker in idle[: len(waiting)]:
                    busy[worker] = number = waiting.pop()
                    worker.send(json.dumps([number, *runs[number]]).encode() + b"\n")
                    selector.register(worker.answers, selectors.EVENT_READ, worker)
                for key, _ in selector.select(_LOOK_S):
                    selector.unregister(key.fileobj)
                    number = busy.pop(key.data)
                    yield number, self._answer(key.data, *runs[number])

    def _start(self) -> _Worker:
        stderr = tempfile.TemporaryFile()  # noqa: SIM115  # closed with its process
        try:
            process = child_process.start(
                _MODULE, stdin=PIPE, stdout=PIPE, stderr=stderr.fileno(), variables=_ONE_THREAD
            )
        except OSError as error:
            stderr.close()
            raise SetupError(f"no process can be started for the runs: {error.strerror}") from error
        worker = _Worker(process, stderr)
        worker.send(self._job)
        return worker

    def _answer(self, worker: _Worker, point: Point, seed: int) -> Outcome:
        """Return the outcome of a worker's run; remove a dead worker."""
        line = worker.answers.readline()
        if line.endswith(b"\n"):
            _, figures, failed = json.loads(line)
            found: Figures = figures
            return Outcome(point, seed, found, failed)
        self._workers.remove(worker)
        failed = worker.death()
        self._close(worker)
        return Outcome(point, seed, {}, failed)

    @staticmethod
    def _close(worker: _Worker) -> None:
        """Wait for an ended or killed process, and close its pipes."""
        assert worker.process.stdin is not None
        with contextlib.suppress(OSError):
            worker.process.stdin.close()
        worker.answers.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            worker.process.wait(_END_S)
        worker.stderr.close()


def processors() -> int:
    """Return the number of processors that this program may use."""
    return len(os.sched_getaffinity(0))
