"""Duration of a start: python tests/bench/bench_start.py [--before /path/to/other]

Processor time of the processes, the least of rounds that take turns with those of another version:
help, a command to a running rig, and ``gazerig run --mock`` until its first tick has written goals
(of the control loop's own process). Then the memory of that process after five seconds, alone, with
a page, and with a film in front of the detectors and a page. Nothing here passes or fails.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

COMMANDS = (("--help",), ("run", "--help"), ("check", "desk"), ("ctl", "--help"))
RUN = """
import sys, time
begun = time.process_time()
from gazerig.robot.app import session
from gazerig.robot.app.options import RunOptions
imported = time.process_time()
composed = session.compose(RunOptions(mock=True, {options}).check_and_complete())
made = time.process_time()
run = session.Session(composed, lambda: None, lambda line: None, summarised=False)
with run.power_on() as loop:
    loop.step()
    ticked = time.process_time()
    for _ in range({ticks}):
        loop.step()
    lines = open("/proc/self/status").read().splitlines()
    kb = {{line.split()[0]: int(line.split()[1]) for line in lines if line.startswith("VmRSS")}}
    run.stopped_by = "seconds"
composed.assembly.close()
import json
print(json.dumps([begun, imported - begun, made - imported, ticked - made, ticked, kb["VmRSS:"] / 1e3]))
"""


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--before", help="the clone of another version")
    args = parser.parse_args()
    own = os.environ.get("PYTHONPATH", str(Path(__file__).parents[2]))
    versions = {"before": args.before, "now": own} if args.before else {"now": own}
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    for words in COMMANDS:
        least = dict.fromkeys(versions, 1e9)
        for _ in range(args.rounds):
            for name, links in versions.items():
                least[name] = min(least[name], spent_s(words, str(links)))
        said = " -> ".join(f"{s:.3f}" for s in least.values())
        print(f"gazerig {' '.join(words):16} {said} s")
    rows: dict[str, list[list[float]]] = {name: [] for name in versions}
    for _ in range(args.rounds):
        for name, links in versions.items():
            rows[name].append(run('scene="visitor"', 0, str(links)))
    parts = ("Python", "import", "compose", "start", "all until the first tick")
    for at, part in enumerate(parts):
        said = " -> ".join(f"{min(row[at] for row in found):.3f}" for found in rows.values())
        print(f"run --mock: {part:25} {said} s")
    with tempfile.TemporaryDirectory() as folder:
        film = Path(folder) / "film.avi"
        write_film(film)
        page = 'page="127.0.0.1:8793"'
        for label, options in (
            ("alone", 'scene="visitor"'),
            ("with a page", f'scene="visitor", {page}'),
            ("with a page and a camera", f'video=__import__("pathlib").Path("{film}"), {page}'),
        ):
            memory = [run(options, 1000, str(links))[-1] for links in versions.values()]
            print(f"memory {label:30} {' -> '.join(f'{mb:.0f}' for mb in memory)} MB")


def spent_s(words: tuple[str, ...], links: str) -> float:
    """Return the processor time of a command."""
    code = f"import sys; sys.argv = ['gazerig', *{list(words)!r}]\n"
    code += "from gazerig.robot.cli.entry_point import main\nmain()"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environ = {**os.environ, "PYTHONPATH": links}
    quiet = subprocess.DEVNULL
    subprocess.run(
        [sys.executable, "-c", code], env=environ, stdout=quiet, stderr=quiet, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run(options: str, ticks: int, links: str) -> list[float]:
    """Return seconds of each part of a start, and megabytes after some ticks."""
    code = RUN.format(options=options, ticks=ticks)
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": links},
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    found: list[float] = json.loads(done.stdout.splitlines()[-1])
    return found


def write_film(file: Path) -> None:
    """Write a film of noise, 640 by 480."""
    rng = np.random.default_rng(0)
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (640, 480))
    for _ in range(30):
        writer.write(rng.integers(0, 255, (480, 640, 3), np.uint8))
    writer.release()


if __name__ == "__main__":
    main()
