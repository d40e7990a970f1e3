"""What ``make run`` gives on this computer with a browser that draws in software, under load.

    python tests/bench/bench_small_computer.py [--loads 0 2 4] [--seconds 60] [-- OPTION ...]

A row for each load (busy processes in the session of the run): the options that ``make run`` chose,
seconds from the start to the page, ticks on time, pictures of the camera and of the view that the
browser drew per second, warnings of the page and of the terminal, processor time per second of the
loop, the camera, the world, the page and the browser, and the computer's load average. The first
minute counts, from the first tick. Options after ``--`` replace those of ``make run``.

``--ahead`` moves all sessions of the bench before those of other users of a busy computer (their
autogroups by 9 steps of nice, which needs root); their order among each other stays. ``--user``
runs without the privilege to raise priorities, also as root.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))
from browser import browsing  # noqa: E402
from page_layout import value  # noqa: E402

from gazerig.robot.remote.client import RobotClient  # noqa: E402

ALONE = [sys.executable, "-m", "gazerig.drivers.process.own_session"]
USER = ["setpriv", "--inh-caps", "-sys_nice", "--bounding-set", "-sys_nice"]
BUSY = "import os\nparent = os.getppid()\nwhile os.getppid() == parent:\n    sum(range(100000))"
COUNT = """(() => {
  window.pictures = 0;
  document.addEventListener('load', ({target}) => {
    if (target.tagName === 'IMG' && target.closest('[data-panel=camera]')) window.pictures += 1;
  }, true);
  if (window.top === window) return;
  const draw = WebGL2RenderingContext.prototype.clear;
  let last = -1;
  window.views = 0;
  WebGL2RenderingContext.prototype.clear = function (mask) {
    const now = document.timeline.currentTime;
    if (now !== last) { last = now; window.views += 1; }
    draw.call(this, mask);
  };
})()
"""
LOOK = """(() => {
  const shown = e => e && !e.hidden && e.checkVisibility() && e.innerText.trim();
  const bars = ['#busy', '#rig-words', '[data-panel=headline]'].map(s => document.querySelector(s))
    .filter(shown).map(e => e.innerText.trim().replace(/\\s+/g, ' '));
  return [window.pictures ?? 0, document.querySelector('#view')?.contentWindow?.views ?? 0, bars];
})()"""


def main() -> None:
    """Measure, and print rows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--loads", type=int, nargs="*", default=[0, 2, 4])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--no-browser", action="store_true")
    parser.add_argument("--ahead", action="store_true")
    parser.add_argument("--user", action="store_true")
    parser.add_argument("options", nargs="*")
    args = parser.parse_args()
    if os.getsid(0) != os.getpid():
        os.setsid()
    if args.ahead:
        threading.Thread(target=go_ahead, daemon=True).start()
    print(f"{os.cpu_count()} processors")
    for _ in range(args.rounds):
        for load in args.loads:
            print(row(load, args), flush=True)


def go_ahead() -> None:
    """Move each new session of this process and its descendants ahead."""
    moved: dict[int, int] = {}
    while True:
        parents: dict[int, int] = {}
        sessions: dict[int, int] = {}
        for file in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):
                fields = file.read_text().rpartition(")")[2].split()
                parents[int(file.parent.name)] = int(fields[1])
                sessions[int(file.parent.name)] = int(fields[3])
        for pid, session in sessions.items():
            above = pid
            while above in parents and above != os.getpid():
                above = parents[above]
            if above != os.getpid():
                continue
            with suppress(OSError):
                group = Path(f"/proc/{pid}/autogroup")
                nice = int(group.read_text().split()[-1])
                if nice != moved.get(session):  # new, or it has set its own niceness meanwhile
                    moved[session] = max(-20, nice - 9)
                    group.write_text(str(moved[session]))
        time.sleep(0.2)


def chosen(begin: list[str]) -> list[str]:
    """Return the options that ``make run`` adds.

    begin: words before the command
    """
    words = [*begin, sys.executable, "-m", "gazerig.features.world.run.first_world"]
    return subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.split()


def row(load: int, args: argparse.Namespace) -> str:
    """Return one row."""
    began_s = time.monotonic()
    busy = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(load)]
    begin = USER if args.user else []
    options = args.options or chosen(begin)
    start = "from gazerig.robot.cli.entry_point import main; main()"
    words = [*begin, *ALONE, sys.executable, "-c", start, "run", "--mock", *options]
    summary = Path(tempfile.mkdtemp()) / "summary.json"
    words += ["--no-browser", "--page", "127.0.0.1:8790", "--summary", str(summary)]
    run = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    lines: list[str] = []
    page = threading.Event()

    def listen() -> None:
        assert run.stdout is not None
        for line in run.stdout:
            lines.append(line.strip())
            if "the page is at" in line:
                page.set()

    threading.Thread(target=listen, daemon=True).start()
    try:
        if not page.wait(120.0):
            return f"load {load}: no page: {lines}"
        start_s = time.monotonic() - began_s
        bars: set[str] = set()
        looks = barred = 0
        with RobotClient.connect(run.pid) as rig:
            url = str(rig.status()["page"])
        if args.no_browser:
            time.sleep(args.seconds)
            found: list[Any] = [0, 0, []]
            shown_s, spent = args.seconds, times(run.pid)
        else:
            with browsing(drawing=COUNT) as browser:
                browser.go(url)
                end_s = time.monotonic() + args.seconds
                first, first_s, before = None, 0.0, {}
                while time.monotonic() < end_s:
                    time.sleep(2.0)
                    found = value(browser, LOOK)
                    bars |= set(found[2])
                    looks, barred = looks + 1, barred + bool(found[2])
                    if first is None and found[0]:
                        first, first_s, before = found, time.monotonic(), times(run.pid)
                shown_s = time.monotonic() - first_s
                found = [
                    now - then for now, then in zip(found[:2], (first or found)[:2], strict=True)
                ]
                spent = {k: (s - before.get(k, 0.0)) / shown_s for k, s in times(run.pid).items()}
        run.send_signal(signal.SIGINT)
        run.wait(30.0)
        figures = json.loads(summary.read_text())
    finally:
        run.kill()
        run.wait()
        for process in busy:
            process.kill()
            process.wait()
    said = [line for line in lines if re.search("busy[ ,;:]|late[ :]|faults", line)]
    ticks, late = figures["ticks"], figures["overruns"]
    slots, cores = ticks + late, " ".join(f"{role} {cpu:.2f}" for role, cpu in spent.items())
    cells = (
        f"load {load}",
        " ".join(options) or "scene",
        f"page {start_s:.1f} s",
        f"camera {found[0] / shown_s:.1f}/s, view {found[1] / shown_s:.1f}/s",
        f"bars in {barred} of {looks} looks" + (f": {sorted(bars)[-1]}" if bars else ""),
        f"{len(said)} lines of warning" + (f": {said[0]}" if said else ""),
        f"on time {ticks / slots:.1%} of {slots / figures['wall_seconds']:.0f} Hz",
        cores,
        f"load average {os.getloadavg()[0]:.1f}",
    )
    return " | ".join(cells)


def times(pid: int) -> dict[str, float]:
    """Return processor seconds of the run's processes and of all browsers, by their role."""
    tick = os.sysconf("SC_CLK_TCK")
    rows: dict[int, tuple[int, str, float]] = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, fields = file.read_text().partition("(")[2].rpartition(")")[::2]
            words = (file.parent / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        part = fields.split()
        spent = (int(part[11]) + int(part[12])) / tick
        rows[int(file.parent.name)] = int(part[1]), f"{name} {words}", spent
    kinds = {"page_main": "page", "pty.server": "servos", "spawn_main": "camera"}
    loop = next((one for one, (parent, _, _) in rows.items() if parent == pid), pid)
    roles: dict[str, float] = {"loop": rows[loop][2]} if loop in rows else {}
    for parent, words, spent in rows.values():
        kind = next((k for w, k in kinds.items() if w in words and parent == loop), None)
        if "chrom" in words.lower():
            kind = "browser"
        if kind is not None:
            roles[kind] = roles.get(kind, 0.0) + spent
    return roles


if __name__ == "__main__":
    main()
