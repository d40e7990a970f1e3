"""A running rig in another process, to be tuned from a shell.

That process is a branch of this one: a loop before an emulated bus, in simulated time that passes
slower than real, so that it leaves the processor to the commands.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from branch import Branch
from ideal_bus import ideal_buses

from gazerig.config.load import ConfigError, shipped_path
from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.control.loop import Tick
from gazerig.robot.control.loop import run as run_loop
from gazerig.robot.model import commands
from gazerig.robot.remote import socket_server
from gazerig.robot.remote.live_server import LiveServer

PACE_S = 0.01  # real seconds a tick


def here(work: Callable[..., Any], *words: Any, **named: Any) -> Any:
    """Call a function in this process, which has no servos that wait."""
    return work(*words, **named)


def serve(path: Path) -> None:
    """Run until SIGTERM; passes the rig's messages to standard error."""
    commands.MIN_HOLD_S = commands.MIN_RESUME_GAP_S = 0.0  # time is slow here
    # What takes time for the loop's sake is tested where it is done: shares of the processor,
    # files that are read in another process, and a file that is looked at twice a second.
    socket_server.EACH = socket_server.ALL = (1.0, 60.0)
    over: list[str] = []
    signal.signal(signal.SIGTERM, lambda *_: over.append("SIGTERM"))
    with ideal_buses():
        options = RunOptions(mock=True, fast=True, seed=0, scene="visitor")
        made = assemble(load_rig(str(path)), options)
    robot = made.robot

    def say(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    about = {"rig": str(path), "name": "my", "pid": os.getpid()}
    tuning = ParamStore(made.live_params, robot.command, str(path), elsewhere=here)
    live = LiveServer(robot, tuning, (ConfigError,), made.clock, about, say)

    def watch(tick: Tick) -> None:
        live.update(tick)
        for event in tick.events:
            say(event)
        time.sleep(PACE_S)

    robot.start(made.clock)
    live.open()
    print("open", flush=True)
    try:
        run_loop(robot, made.clock, made.loop, lambda _: over[0] if over else None, watch)
    finally:
        live.close()
        robot.stop()
        made.close()


class Running(NamedTuple):
    """A rig in another process."""

    process: subprocess.Popen[str]
    path: Path
    log: Path

    def hears(self, words: str) -> bool:
        """Wait for a message."""
        for _ in range(400):
            if words in self.log.read_text(encoding="utf-8"):
                return True
            time.sleep(0.05)
        return False


@contextlib.contextmanager
def a_rig() -> Iterator[Running]:
    folder = Path(tempfile.mkdtemp(prefix="gz-", dir="/tmp"))
    path, log = Path(shutil.copy(shipped_path("rigs", "desk"), folder / "my.yaml")), folder / "log"
    with log.open("w") as said:
        process = Branch(
            lambda: serve(path),
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            env={**os.environ, "XDG_RUNTIME_DIR": str(folder)},
        )
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "open\n", log.read_text(encoding="utf-8")
            yield Running(process, path, log)
        finally:
            process.terminate()
            process.communicate(timeout=20.0)
            shutil.rmtree(folder)


@contextlib.contextmanager
def a_rig_beside() -> Iterator[subprocess.Popen[str]]:
    """A second one whose sockets are in the same folder."""
    path = Path(os.environ["XDG_RUNTIME_DIR"]) / "my.yaml"
    process = Branch(
        lambda: serve(path),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=dict(os.environ),
    )
    try:
        assert process.stdout is not None and process.stdout.readline() == "open\n"
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=20.0)
