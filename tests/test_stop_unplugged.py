"""A stop while the adapter is unplugged: remembered, and carried out when it is back."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from bus_kinds import KINDS, in_process
from mixed_rig import rig_of

import gazerig.robot.app.run_bus as run_bus
from gazerig.drivers.errors import BusLost
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.model.commands import Resume, Stop
from gazerig.sim_mock.device import Device
from gazerig.testing import BusBench

RIGS = ("feetech", "mixed")


@pytest.fixture
def twin(request: pytest.FixtureRequest) -> BusBench:
    return in_process(request.param)


@pytest.mark.parametrize("twin", KINDS, indirect=True)
def test_what_could_not_be_released_is_when_the_port_is_back(twin: BusBench) -> None:
    bus = twin.hold(give_up_s=1.0)
    twin.run(bus, 0.1)
    twin.command("unplug")
    with pytest.raises(BusLost):
        bus.disable_torque()
    for _ in range(300):  # longer than its time-out
        twin.wait(0.01)
        try:
            bus.read(twin.now_s())
        except BusLost:
            continue
    assert all(twin.holding())
    twin.command("plug")
    _read_on(twin, bus, 0.5)
    assert not any(twin.holding())
    assert any("torque switched off" in event for event in bus.events())
    _read_on(twin, bus, 3.0)
    assert not any(twin.holding())
    bus.enable_torque()
    _read_on(twin, bus, 0.2)
    assert all(twin.holding())
    bus.disable_torque()
    bus.close()


@pytest.mark.parametrize("twin", KINDS, indirect=True)
def test_torque_that_came_on_only_here_and_there_is_taken_off(twin: BusBench) -> None:
    bus = twin.hold()
    bus.disable_torque()
    twin.run(bus, 0.1)
    twin.command("unplug")
    with pytest.raises(BusLost):
        bus.enable_torque()
    twin.command("plug")
    _read_on(twin, bus, 1.0)
    assert not any(twin.holding())


def _read_on(twin: BusBench, bus: Any, seconds: float) -> None:
    end_s = twin.now_s() + seconds
    while twin.now_s() < end_s:
        twin.wait(0.01)
        try:
            bus.read(twin.now_s())
        except BusLost:
            continue


class Machine:
    """A whole robot before emulated buses that can be unplugged."""

    def __init__(self, made: Assembly, devices: dict[str, Device]) -> None:
        self.made, self.devices = made, devices
        self.ticks: list[Tick] = []
        self.ended = ""
        made.robot.start(made.clock)

    def go(self, seconds: float) -> list[Tick]:
        began = len(self.ticks)
        self.ended = run(
            self.made.robot,
            self.made.clock,
            self.made.loop,
            lambda s: "seconds" if s >= seconds else None,
            self.ticks.append,
        ).stopped_by
        return self.ticks[began:]

    def command(self, text: str) -> None:
        for device in self.devices.values():
            device.faults.command(text)

    def holding(self) -> list[bool]:
        """Return which servos truly hold their place."""
        servos = [
            one
            for device in self.devices.values()
            for one in json.loads(device.faults.command("status"))["servos"]
        ]
        return [bool(one.get("target", one.get("torque"))) for one in servos]

    def said(self, words: str) -> bool:
        return any(words in event for tick in self.ticks for event in tick.events)


@pytest.fixture
def machine(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Iterator[Machine]:
    rig = rig_of(request.param, tmp_path)
    devices: dict[str, Device] = {}
    build: Callable[..., Device] = run_bus.build

    def kept(line: Any, now_s: Callable[[], float]) -> Device:
        device = build(line, now_s)
        devices[f"{len(devices)}"] = device
        return device

    monkeypatch.setattr(run_bus, "build", kept)
    made = assemble(rig, RunOptions(mock=True, fast=True, seed=2, scene="face-to-face"))
    machine = Machine(made, devices)
    yield machine
    made.close()


@pytest.mark.parametrize("machine", RIGS, indirect=True)
def test_a_stop_while_unplugged_is_carried_out_at_once_when_it_is_back(machine: Machine) -> None:
    machine.go(1.0)
    held = machine.holding()
    machine.command("unplug")
    machine.made.robot.command(Stop("a hand", who="the space bar"))
    ticks = machine.go(7.0)  # longer than the bus's time-out
    assert machine.ended == "seconds" and ticks[-1].stopped == "a hand"
    assert machine.said("the stop is pending, torque is NOT YET off")
    assert any(machine.holding())
    ticket = machine.made.robot.command(Resume(who="the space bar"))
    machine.go(0.1)
    reply = ticket.wait(0.0)
    assert reply is not None and reply.refused.startswith("still stopped: ")
    machine.command("plug")
    machine.go(0.5)
    assert not any(machine.holding())
    assert machine.said("torque switched off, as requested while the port was gone")
    machine.go(4.0)
    assert not any(machine.holding()) and machine.ticks[-1].stopped
    machine.made.robot.command(Resume(who="the space bar"))
    machine.go(2.0)
    assert machine.holding() == held and not machine.ticks[-1].stopped
    machine.made.robot.stop()
    assert not any(machine.holding())


@pytest.mark.parametrize("machine", ["desk", "feetech"], indirect=True)
def test_torque_that_comes_on_after_a_stop_is_taken_off_again(machine: Machine) -> None:
    machine.go(0.5)
    machine.made.robot.command(Stop("a hand"))
    machine.go(0.5)
    machine.made.robot.body.bus.enable_torque()  # another program on the line
    assert all(machine.holding())
    machine.go(1.0)
    assert not any(machine.holding())
    assert machine.said("still had torque: switched off again")
    machine.made.robot.stop()
