"""A part of a package that fails ends the run, named and with torque off; one that hangs limps."""

import json
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from branch import Branch
from loop_deaths import PATIENCE_S, Driven, rig_of
from outside_bus import HEAD, install_example
from outside_package import install, on_path
from slow_rigs import at_rate

import gazerig
from gazerig.config.parameters import apply_changes
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.errors import BusLost
from gazerig.drivers.plugins import ATTENTION, CAMERA, DETECTOR
from gazerig.drivers.types import ServoConfig
from gazerig.robot.run import buses as run_buses
from gazerig.robot.run import session
from gazerig.robot.run.emulated import emulated_lines
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.sim_mock.pty.client import PtyBuses

ODD = """
from gazerig.drivers.camera.source import Shot

class Odd:
    number = 0
    def open(self): pass
    def close(self): pass
    def events(self): return ()
    def fail(self, *_):
        self.number += 1
        if self.number > 10:
            raise KeyError("no body")
    choose = latest = fail
    def find(self, image):
        self.fail()
        return ()
"""


@pytest.fixture
def odd(tmp_path: Path) -> Iterator[None]:
    """Install a package whose parts fail at the eleventh call, and one with a bus."""
    groups = {"attention": ATTENTION, "camera": CAMERA, "detector": DETECTOR}
    parts = {group: {"odd": f"odd_{name}:Odd"} for name, group in groups.items()}
    install_example(tmp_path / "site")
    with on_path(tmp_path / "site") as site:
        modules = {f"odd_{name}": ODD for name in groups}
        install(site, "odd", parts, modules)
        yield


def end_of_run(
    rig: Rig,
    monkeypatch: pytest.MonkeyPatch,
    stopped: Callable[[PtyBuses], str | None] = lambda buses: None,
    **options: Any,
) -> tuple[str, list[str], bool]:
    """Run a rig; return the reason of its end, its lines, and whether torque stays on."""
    devices: list[Any] = []
    make = run_buses.build

    def build(*words: Any) -> Any:
        devices.append(make(*words))
        return devices[-1]

    monkeypatch.setattr(run_buses, "build", build)
    options = {"mock": True, "fast": True, "seconds": 5.0, "seed": 0, **options}
    lines: list[str] = []
    with PtyBuses() as buses:
        if not options["fast"]:
            (path,) = buses.start(emulated_lines(rig)).values()
            options |= {"mock": False, "port": path}
        chosen = RunOptions(**options)
        figures = session.Session(Run(rig, chosen), lambda: stopped(buses), lines.append).run()
        commands = [device.faults.command for device in devices] or [buses.command]
        held = [
            one.get("target", one.get("torque"))
            for command in commands
            for one in json.loads(command("status"))["servos"]
        ]
    assert held
    return str(figures["stopped_by"]), lines, any(held)


@pytest.mark.usefixtures("odd")
@pytest.mark.parametrize("kind", ["feetech", "maestro", "lx16a"])
def test_a_rule_that_raises_ends_the_run(kind, monkeypatch):
    rig = load_rig(str(HEAD)) if kind == "lx16a" else rig_of(kind)
    rig = apply_changes(rig, {"gaze.chooser": "odd"})
    ended, lines, held = end_of_run(rig, monkeypatch, scene="visitor")
    assert ended == "fault: attention 'odd' of odd 1.2 failed (KeyError: 'no body')"
    assert not held and lines[-1].startswith(f"stopped by {ended}: parked, torque off")


@pytest.mark.usefixtures("odd")
@pytest.mark.parametrize("part", ["camera", "detector", "bus"])
def test_another_part_that_raises_ends_the_run(part, monkeypatch):
    rig, options, label = load_rig("desk"), dict[str, Any](scene="visitor"), "odd 1.2"
    match part:
        case "camera":
            options = {"camera": "odd", "fast": False, "scene": None, "rate": 50.0}
        case "detector":
            rig, options["pixels"] = apply_changes(rig, {"detector.kind": "odd"}), True
        case "bus":
            rig, label = load_rig(str(HEAD)), "gazerig-lx16a"
            bus = __import__("gazerig_lx16a.bus").bus
            exec("def fail(self, goals): raise KeyError('no body')", vars(bus))
            monkeypatch.setattr(bus.Lx16aBus, "write", bus.fail)
    ended, lines, held = end_of_run(rig, monkeypatch, **options)
    assert part in ended and label in ended and ended.endswith("failed (KeyError: 'no body')")
    assert not held and "torque off" in lines[-1]


def test_a_rule_that_returns_no_point_ends_the_run():
    for answer in ((nan, 0.0, 0.0), (1.0, inf, 0.0), (1.0, 0.0), "abc", 7):
        rule: Any = SimpleNamespace(choose=lambda *_, answer=answer: answer)
        with (
            pytest.raises(gazerig.HeadEnded, match="attention SimpleNamespace of the program"),
            gazerig.open("desk", fast=True, attention=rule) as head,
        ):
            head.sleep(1.0)


# --- parts that hang


def wait(*_: object) -> None:
    threading.Event().wait()


class Hanging:
    """A rule that hangs after some ticks."""

    ticks = 0

    def choose(self, *_: object) -> Any:
        self.ticks += 1
        if self.ticks == 10:
            print("moving", flush=True)
        if self.ticks > 25:
            wait()


def _hang(path: str, file: str) -> None:
    with gazerig.open(file, port=path, attention=Hanging(), say=lambda line: None):
        time.sleep(2.0 * PATIENCE_S)


def test_a_rule_that_hangs_leaves_limp_servos(tmp_path):
    file = at_rate(tmp_path, "feetech", 50.0)
    rig = load_rig(file)
    with PtyBuses() as buses:
        (path,) = buses.start(emulated_lines(rig)).values()
        loop = Branch(partial(_hang, path, file), stdout=subprocess.PIPE, text=True)
        late = threading.Timer(2.0 * PATIENCE_S, loop.kill)
        late.start()
        try:
            it = Driven(loop, buses, frozenset(joint.id for joint in rig.joints.values()))
            it.line("moving")
            assert any(it.holding())
            assert it.limp_after_s(time.monotonic(), PATIENCE_S) is not None
        finally:
            late.cancel()
            loop.kill()
            loop.communicate()


# --- values of a package's bus


SERVOS = tuple(ServoConfig(i, "m", 0, 1000, 500.0, name) for i, name in enumerate(("neck", "jaw")))


def test_goals_are_clipped_and_every_bus_is_released():
    sent, released = list[list[int]](), list[int]()

    def fail() -> None:
        raise KeyError("b")

    package: Any = SimpleNamespace(write=sent.append, disable_torque=fail)
    ours: Any = SimpleNamespace(write=sent.append, disable_torque=lambda: released.append(1))
    shares = [BusShare("bus 'b' of b 1", package, (0,)), BusShare("ours", ours, (1,))]
    bus = MultiBus(shares, SERVOS)
    bus.write([-5, 2000])
    assert sent == [[0], [1000]]
    with pytest.raises(BusLost, match="bus 'b' of b 1: torque-off failed .*: cut the servo power"):
        bus.disable_torque()
    assert released == [1]
