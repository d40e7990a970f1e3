"""Costs beside a peer, measured in one run: python tests/bench/bench.py [CASE ...]

Four cases: tick, bus, start, camera. Each prints what something
costs and the ratio to a peer that ran in turns with it, so that other load strikes both alike.
Compare figures of one run with each other, on a machine that has nothing else to do. Nothing here
passes or fails.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / "helpers"), str(TESTS / "judges")]
MAIN = "from gazerig.robot.cli.entry_point import main; main()"
RUN = ("run", "desk", "--mock", "--scene", "visitor", "--seed", "0", "--summary", "-")
FAST = (*RUN, "--fast", "--no-page")
ROUNDS = 5


class Done(NamedTuple):
    """A program that has ended: seconds, processor seconds with its children, output."""

    wall_s: float
    cpu_s: float
    out: str

    @property
    def summary(self) -> dict[str, Any]:
        """The summary of a run."""
        found: dict[str, Any] = json.loads(self.out[self.out.index("{") :])
        return found


def python(code: str, *words: str) -> Done:
    """Run Python to its end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began_s = time.monotonic()
    command = [sys.executable, "-c", code, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wall_s = time.monotonic() - began_s
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(words)} failed: {done.stderr}")
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Done(wall_s, cpu_s, done.stdout)


def gazerig(*words: str) -> Done:
    """Run a command of gazerig to its end."""
    return python(MAIN, *words)


def in_turns(works: Mapping[str, Callable[[], float]], rounds: int = ROUNDS) -> dict[str, float]:
    """Return the median of what each work measures, in rounds that take turns."""
    found: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            found[name].append(work())
    return {name: median(values) for name, values in found.items()}


def timed(work: Callable[[], object], count: int = 1) -> float:
    """Return the processor time of this process for one call, in us."""
    began_s = time.process_time()
    for _ in range(count):
        work()
    return 1e6 * (time.process_time() - began_s) / count


def show(figures: Mapping[str, float], unit: str, peer: str) -> None:
    """Print figures, each with its ratio to the peer's."""
    for name, value in figures.items():
        ratio = "" if name == peer else f"   x {value / figures[peer]:.2f} of {peer}"
        print(f"  {name:44} {value:10.1f} {unit}{ratio}")


def bench_tick() -> None:
    """A tick of the desk rig in simulated and in real time, beside a step of ruckig."""
    from fakes.runs import play
    from ruckig import InputParameter, OutputParameter, Ruckig

    from gazerig.config.schema import load_rig
    from gazerig.robot.run.options import RunOptions
    from gazerig.robot.run.run import Run

    planner, given, found = Ruckig(9, 0.005), InputParameter(9), OutputParameter(9)
    given.max_velocity, given.max_acceleration = [6.0] * 9, [60.0] * 9
    given.max_jerk = [1000.0] * 9
    sides = iter(range(10**9))

    def step() -> None:
        k = next(sides)
        if k % 30 == 0:  # a new target several times a second, as a gaze has
            given.target_position = [(-1) ** (k // 30) * (0.1 + 0.05 * axis) for axis in range(9)]
        planner.update(given, found)
        found.pass_to_input(given)

    def tick(bus: str) -> float:
        made = Run(load_rig("desk"), RunOptions(True, True, 0, "visitor", bus=bus))
        return timed(lambda: play(made, 10.0)) / 2000

    peer = "ruckig, a step of nine axes"
    works = {name: partial(tick, bus) for name, bus in (("tick, emulated servos", "emulated"),
             ("tick, ideal servos", "ideal"))}  # fmt: skip
    figures = in_turns({**works, peer: lambda: timed(step, 2000)})
    show(figures, "us of processor", peer)
    for name in works:
        print(f"  {name}: {5000.0 / figures[name]:.1f} simulated seconds a second of processor")
    done = gazerig(*RUN, "--no-page", "--seconds", "20")
    ticks, late = done.summary["ticks"], done.summary["overruns"]
    print(f"  real time, all processes: {100 * done.cpu_s / done.wall_s:.0f} % of a core, "
          f"{late} of {ticks} slots missed")  # fmt: skip


def bench_bus() -> None:
    """A cycle of nine servos, beside clients of others."""
    from bus_clients import CLIENTS, IDS, served

    for kind, clients in CLIENTS.items():
        lost = dict.fromkeys(clients, 0)

        def spent(name: str, cycle: Callable[[int], int], lost: dict[str, int] = lost) -> float:
            return timed(lambda: lost.update({name: lost[name] + len(IDS) - cycle(3)}), 300)

        with ExitStack() as stack:
            cycles = {
                name: stack.enter_context(served(kind, open_)) for name, open_ in clients.items()
            }
            figures = in_turns({name: partial(spent, name, cycles[name]) for name in cycles})
            show(figures, f"us of processor a cycle ({kind})", "rustypot")
        print(f"  lost values: {lost}")


def bench_start() -> None:
    """Commands until their end, and a run until it has parked, beside Python alone."""
    commands: dict[str, tuple[str, ...]] = {
        "gazerig --help": ("--help",),
        "gazerig check desk": ("check", "desk"),
        "gazerig ctl --help": ("ctl", "--help"),
        "gazerig run --mock, .1 s": (*FAST, "--seconds", "0.1"),
    }
    works = {
        name: lambda words=words: 1e3 * gazerig(*words).cpu_s for name, words in commands.items()
    }
    peer = "python -c 'import numpy'"
    show(in_turns({**works, peer: lambda: 1e3 * python("import numpy").cpu_s}), "ms", peer)


def bench_camera() -> None:
    """Search for faces and motion in a picture, beside OpenCV's dense flow."""
    import cv2
    from seeing.material import background, eyes_at, paste, portrait

    from gazerig.drivers.camera.source import Shot
    from gazerig.drivers.vision.face.detector import face_detector
    from gazerig.drivers.vision.face.params import FaceDetectorParams
    from gazerig.drivers.vision.motion.params import MotionParams
    from gazerig.robot.perception.motion_source import MotionSource

    cv2.setNumThreads(1)
    picture = background(640, 480).copy()
    paste(picture, portrait("astronaut"), (320.0, 240.0), eyes_at(1.0, 640, 69.0))
    pictures = [np.roll(picture, 3 * k, axis=1) for k in range(8)]
    grey = [cv2.cvtColor(one, cv2.COLOR_BGR2GRAY) for one in pictures]
    faces, motion = (
        face_detector(FaceDetectorParams()),
        MotionSource(MotionParams(), None, 1.2, None),
    )
    flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    numbers = iter(range(1, 10**9))

    def see_motion() -> None:
        number = next(numbers)
        motion(Shot(number / 30.0, number, pictures[number % 8]))

    def see_flow() -> None:
        number = next(numbers)
        flow.calc(grey[number % 8], grey[(number + 1) % 8], None)  # type: ignore[call-overload]

    peer = "OpenCV's dense flow (DIS, fast)"
    works: dict[str, Callable[[], object]] = {
        "faces": lambda: faces.find(pictures[next(numbers) % 8]), "motion": see_motion, peer: see_flow,
    }  # fmt: skip
    figures = in_turns({name: partial(timed, work, 20) for name, work in works.items()})
    show(figures, "us of processor a picture, 640x480", peer)


def cases() -> Iterator[tuple[str, Callable[[], None]]]:
    """Yield all cases by name."""
    for name, work in globals().items():
        if name.startswith("bench_"):
            yield name.removeprefix("bench_"), work


def main() -> None:
    """Measure, and print."""
    every = dict(cases())
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", nargs="*", choices=[*every, []], metavar="CASE")
    names = parser.parse_args().cases or list(every)
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    for name in names:
        print(f"\n{name}: {(every[name].__doc__ or '').splitlines()[0]}")
        every[name]()


if __name__ == "__main__":
    main()
