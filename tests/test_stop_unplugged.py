"""A stop while the adapter is unplugged: remembered, and carried out when it is back."""

import json
from typing import Any

import pytest
from mixed_rig import rig_of

import gazerig.robot.app.run_bus as run_bus
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run
from gazerig.robot.model.commands import Resume, Stop


class Machine:
    """A whole robot before emulated buses that can be unplugged."""

    def __init__(self, monkeypatch, rig):
        self.devices, build = list[Any](), run_bus.build

        def kept(*given):
            self.devices.append(build(*given))
            return self.devices[-1]

        monkeypatch.setattr(run_bus, "build", kept)
        self.made = assemble(rig, RunOptions(mock=True, fast=True, seed=2, scene="face-to-face"))
        self.ticks = []
        self.made.robot.start(self.made.clock)

    def go(self, seconds):
        made = self.made
        end = run(made.robot, made.clock, made.loop, lambda s: "seconds" if s >= seconds else None,
                  self.ticks.append)  # fmt: skip
        assert end.stopped_by == "seconds"

    def command(self, text):
        return [device.faults.command(text) for device in self.devices]

    def holding(self):
        servos = [one for text in self.command("status") for one in json.loads(text)["servos"]]
        return [bool(one.get("target", one.get("torque"))) for one in servos]

    def said(self, words):
        return any(words in event for tick in self.ticks for event in tick.events)


@pytest.mark.parametrize("name", ["feetech", "mixed"])
def test_a_stop_while_unplugged_is_carried_out_at_once_when_it_is_back(monkeypatch, tmp_path, name):
    machine = Machine(monkeypatch, rig_of(name, tmp_path))
    robot = machine.made.robot
    machine.go(1.0)
    held = machine.holding()
    machine.command("unplug")
    robot.command(Stop("a hand", who="the space bar"))
    machine.go(7.0)  # longer than the bus's time-out
    assert machine.ticks[-1].stopped == "a hand"
    assert machine.said("the stop is pending, torque is NOT YET off") and any(machine.holding())
    ticket = robot.command(Resume(who="the space bar"))
    machine.go(0.1)
    reply = ticket.wait(0.0)
    assert reply and (reply.refused or "").startswith("still stopped: ")
    machine.command("plug")
    machine.go(0.5)
    assert not any(machine.holding())
    assert machine.said("torque switched off, as requested while the port was gone")
    machine.go(4.0)
    assert not any(machine.holding()) and machine.ticks[-1].stopped
    robot.command(Resume(who="the space bar"))
    machine.go(2.0)
    assert machine.holding() == held and not machine.ticks[-1].stopped
    robot.command(Stop("a hand"))
    machine.go(0.5)
    robot.body.bus.enable_torque()  # another program on the line
    machine.go(1.0)
    assert not any(machine.holding()) and machine.said("still had torque: switched off again")
    machine.made.close()
