"""A stop while the adapter is unplugged: remembered, and carried out when it is back."""

import json

from commanded_robot import Running
from fakes.runs import simulated
from mixed_rig import rig_of

from gazerig.robot.model.commands import Resume, Stop


def test_a_stop_while_unplugged_is_carried_out_at_once_when_it_is_back(devices, tmp_path):
    running = Running(simulated(rig_of("mixed", tmp_path), "face-to-face", 2, rate=50.0))
    robot = running.made.robot
    robot.start(running.made.clock)

    def command(text):
        return [device.faults.command(text) for device in devices]

    def holding():
        servos = [one for text in command("status") for one in json.loads(text)["servos"]]
        return [bool(one.get("target", one.get("torque"))) for one in servos]

    def said(words):
        return any(words in event for tick in running.ticks for event in tick.events)

    running.go(1.0)
    held = holding()
    command("unplug")
    robot.command(Stop("a hand", who="the space bar"))
    running.go(7.0)  # longer than the bus's time-out
    assert running.ticks[-1].stopped == "a hand"
    assert said("the stop is pending, torque is NOT YET off") and any(holding())
    reply, _ = running.do(Resume(who="the space bar"), 0.1)
    assert (reply.refused or "").startswith("still stopped: ")
    command("plug")
    running.go(0.5)
    assert not any(holding())
    assert said("torque switched off, as requested while the port was gone")
    running.go(4.0)
    assert not any(holding()) and running.ticks[-1].stopped
    robot.command(Resume(who="the space bar"))
    running.go(2.0)
    assert holding() == held and not running.ticks[-1].stopped
    robot.command(Stop("a hand"))
    running.go(0.5)
    robot.body.bus.enable_torque()  # another program on the line
    running.go(1.0)
    assert not any(holding()) and said("still had torque: switched off again")
    running.made.close()
