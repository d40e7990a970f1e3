"""Floods of requests at a running rig's socket: what they cost the control loop.

Run by hand: ``python tests/attack/remote_flood.py [seconds]``. A loop on the host's clock before
an emulated bus in this process; other processes flood its socket. Prints a table. It ends with an
error if the loop does not drive its joints before the flood, or a flooder gets no answer.
"""

import os
import subprocess
import sys
import tempfile
from functools import partial

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.clock import RealClock
from gazerig.robot.remote import socket_server as server
from gazerig.robot.remote.live_server import LiveServer
from gazerig.robot.remote.socket_server import ALL, EACH

FLOODS = {
    "nothing": "",
    "work alone": "pass",
    "set": "rig.set_many({'gaze.saccade.max_speed_deg_s': 300.0 + n % 200})",
    "get": "rig.get('')",
    "parameters": "rig.parameters('')",
    "status": "rig.status()",
    "look": "rig.send(LookAt((1.0, 0.001 * (n % 200), 0.2), stay=True))",
    "resume": "rig.resume(confirmed=True)",
}
FLOOD = """
from gazerig.drivers.errors import DriverError
from gazerig.robot.model.commands import LookAt
from gazerig.robot.remote.client import RequestRejected, RobotClient
rig, n = RobotClient.connect(), 0
while True:
    n += 1
    try:
        {}
    except RequestRejected as error:
        if n == 1:
            print(error, flush=True)
    except DriverError:
        pass
    if n == 1:
        print("first", flush=True)
"""


def flooded(what: str, seconds: float, programs: int) -> tuple[float, int, float]:
    """Return the loop's rate, slots lost, and how long a stop took, in ms."""
    made = assemble(load_rig("desk"), RunOptions(True, False, 0, "visitor"))
    robot = made.robot
    tuning = ParamStore(made.live_params, robot.command, "desk")
    about = {"rig": "desk", "pid": os.getpid()}
    live = LiveServer(robot, tuning, (ConfigError,), made.clock, about, lambda _: None)
    robot.start(made.clock)
    live.open()
    newest: list[Tick] = []

    def watch(tick: Tick) -> None:
        newest[:] = [tick]
        live.update(tick)

    def is_driven() -> bool:
        return all(newest[0].joints.torque) and not newest[0].stopped

    command = [sys.executable, "-c", FLOOD.replace("{}", FLOODS[what])]
    begin = partial(subprocess.Popen, command, stdout=subprocess.PIPE, text=True)
    others: list[subprocess.Popen[str]] = []
    try:
        before = run(robot, made.clock, made.loop, lambda s: "s" if s > 0.5 else None, watch)
        assert before.ticks > 10 and is_driven(), "the loop does not drive its joints"
        others += [begin() for _ in range(programs if FLOODS[what] else 0)]
        run(robot, made.clock, made.loop, lambda s: "s" if s > 2.0 else None, watch)
        began_s = RealClock().now_s()
        count = run(robot, made.clock, made.loop, lambda s: "s" if s > seconds else None, watch)
        assert is_driven() and all(other.poll() is None for other in others), "no flood"
        rate = count.ticks / (RealClock().now_s() - began_s)
        stop = [sys.executable, "-c", _STOP]
        with subprocess.Popen(stop, stdout=subprocess.PIPE, text=True) as stopper:
            run(
                robot, made.clock, made.loop,
                lambda s: "s" if stopper.poll() is not None or s > 20.0 else None, watch,
            )  # fmt: skip
            took_ms = float(stopper.communicate()[0] or "nan")
    finally:
        answers = []
        for other in others:
            other.kill()
            answers.append(other.communicate()[0].strip())
        live.close()
        robot.stop()
        made.close()
    assert newest[0].stopped and all(answers), f"not stopped, or no answer to {what}: {answers}"
    for said in sorted({*answers} - {"first"}):
        print(f"{what}: {said}", file=sys.stderr)
    return rate, count.overruns, took_ms


_STOP = """
import time
from gazerig.robot.remote.client import RobotClient
rig = RobotClient.connect()
began = time.monotonic()
rig.stop("a test")
print(1e3 * (time.monotonic() - began))
"""


def main(seconds: float) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory(prefix="gz-", dir="/tmp") as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        print(f"{'flood':10} {'allowed':>8} {'Hz':>7} {'slots lost':>10} {'stop ms':>8}")
        for what in FLOODS:
            for limits in ((EACH, ALL), ((9.0, 9.0), (9.0, 9.0))):
                server.EACH, server.ALL = limits
                rate, lost, took_ms = flooded(what, seconds, 4)
                share = f"{limits[1][0]:.0%}" if limits[1] is ALL else "all"
                print(f"{what:10} {share:>8} {rate:7.1f} {lost:10} {took_ms:8.1f}", flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 5.0)
