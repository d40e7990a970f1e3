"""A loop in a process of its own that drives a rig's emulated servos, to be killed or stopped."""

import json
import os
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from branch import Branch
from child_processes import running_as
from feedback_rows import rows

from gazerig.config.rig import BusConfig, Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.serial.port import BlockingPort
from gazerig.robot.run.buses import bus_ports, guarded_rig_bus, rig_bus
from gazerig.robot.run.emulated import emulated_lines
from gazerig.robot.run.rig_limits import servo_configs
from gazerig.sim_mock.pty.client import PtyBuses

SLOW_DEG_S = 4.0
PATIENCE_S = 30.0
RIGS = {"dynamixel": "desk", "feetech": "feetech", "maestro": "maker", "pca9685": "maker"}
"""The shipped rig of each kind of bus."""


def rig_of(kind: str) -> Rig:
    """Return the shipped rig of a kind, with the other board where its own has none."""
    rig = load_rig(RIGS[kind])
    return replace(rig, bus=BusConfig("/dev/i2c-1", "pca9685")) if kind == "pca9685" else rig


def slow(kind: str) -> Rig:
    """Return a kind's shipped rig whose joints take seconds to their ends."""
    rig = rig_of(kind)
    joints = {n: replace(j, max_speed_deg_s=SLOW_DEG_S) for n, j in rig.joints.items()}
    return replace(rig, joints=joints)


def drive(kind: str, guarded: bool, path: str) -> None:
    """Drive all joints slowly to their ends, 100 ticks a second, and print events."""
    rig = slow(kind)
    paths = bus_ports(rig, path)
    bus = (
        guarded_rig_bus(rig, paths)
        if guarded
        else rig_bus(rig, {name: BlockingPort(path) for name, path in paths.items()})
    )
    bus.open()
    bus.enable_torque()
    goals: list[Any] = [setup.max_steps for setup in servo_configs(rig)]
    said = False
    ticks = 0
    while True:
        for event in bus.events():
            print(f"event {event}", flush=True)
        readings = rows(bus.read(time.monotonic()))
        if any(reading is not None and reading.rearmed for reading in readings):
            goals = [
                goal if r is None else r.position_steps
                for r, goal in zip(readings, goals, strict=True)
            ]
            print("rearmed", flush=True)
        bus.write(goals)
        ticks += 1
        if not said and ticks == 30:
            said = True
            print("moving", flush=True)
        time.sleep(0.01)


class Driven(NamedTuple):
    """A loop's process and what it drives."""

    loop: subprocess.Popen[str]
    buses: PtyBuses
    ids: frozenset[int]

    def strike(self, number: int) -> float:
        """Send the loop a signal; return when."""
        at_s = time.monotonic()
        os.kill(self.loop.pid, number)
        return at_s

    def line(self, beginning: str) -> str:
        """Wait for a line that the loop prints; return it."""
        assert self.loop.stdout is not None
        for line in self.loop.stdout:
            if line.startswith(beginning):
                return line.strip()
        raise AssertionError(f"the loop ended before it said {beginning!r}")

    def guardians(self) -> list[int]:
        """Return the process ids of the loop's guardians."""
        return running_as(self.loop.pid, "gazerig.robot.guardian.process")

    def holding(self) -> list[bool]:
        """Return which servos are under torque, or get pulses."""
        return [bool(one.get("target", one.get("torque"))) for one in self._servos()]

    def places(self) -> list[float]:
        """Return the true positions of the servos."""
        return [one.get("place", one.get("position", 0.0)) for one in self._servos()]

    def _servos(self) -> list[dict[str, float]]:
        servos: list[dict[str, float]] = json.loads(self.buses.command("status", ""))["servos"]
        return [one for one in servos if one["id"] in self.ids]

    def limp_after_s(self, since_s: float, timeout_s: float) -> float | None:
        """Return the time from then until no servo is under torque; None where some stay so."""
        while True:
            limp = not any(self.holding())
            took_s = time.monotonic() - since_s
            if limp:
                return took_s
            if took_s > timeout_s:
                return None
            time.sleep(0.005)


@contextmanager
def driven(kind: str, guarded: bool = True) -> Iterator[Driven]:
    """Return a rig that a loop in another process drives."""
    with PtyBuses() as buses:
        rig = slow(kind)
        (path,) = buses.start(emulated_lines(rig)).values()
        loop = Branch(partial(drive, kind, guarded, path), stdout=subprocess.PIPE, text=True)
        # A line that never comes fails the test instead of hanging it.
        late = threading.Timer(2.0 * PATIENCE_S, loop.kill)
        late.start()
        try:
            it = Driven(loop, buses, frozenset(joint.id for joint in rig.joints.values()))
            it.line("moving")
            assert all(it.holding()), "the loop does not hold its servos: nothing to strike"
            yield it
        finally:
            late.cancel()
            loop.kill()
            loop.wait()
            assert loop.stdout is not None
            loop.stdout.close()
