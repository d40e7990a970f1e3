"""Whatever ends a command that switched torque on: the head parks and the torque goes off."""

import json
from collections.abc import Callable
from typing import Any

import pytest
from attack.ways_out import case, side_by_side
from branch import Branch, gazerig
from features_there import is_there
from slow_rigs import slowed

from gazerig.config.schema import load_rig
from gazerig.drivers.plugins import COMMAND, SHIPPED
from gazerig.robot.cli.run import report_faults
from gazerig.robot.loop.joint_faults import JointFaults
from gazerig.robot.loop.loop import Robot
from gazerig.robot.run import session
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.sim_mock.device import Device

# --- runs in simulated time, on emulated servos that are read afterwards


def on(device: Device) -> int:
    """Count the servos that have torque or pulses."""
    servos: list[dict[str, Any]] = json.loads(device.faults.command("status"))["servos"]
    return sum(bool(servo.get("torque", servo.get("target"))) for servo in servos)


def ran(
    rig: str,
    said: list[str],
    seconds: float = 1.5,
    before: Callable[[Run], None] | None = None,
) -> dict[str, Any]:
    options = RunOptions(True, True, rig=rig, seconds=seconds).check_and_complete()
    made = Run(slowed(load_rig(rig), 50.0), options)
    if before is not None:
        before(made)
    return session.Session(made, lambda: None, said.append).run()


def test_no_memory_in_the_loop_leaves_by_the_door(devices, monkeypatch):
    tick, ticks = Robot.tick, []

    def short_of_memory(self: Robot, *words: Any) -> object:
        ticks.append(on(devices[-1]))
        if len(ticks) > 50:
            raise MemoryError
        return tick(self, *words)

    monkeypatch.setattr(Robot, "tick", short_of_memory)
    for rig in ("desk", "feetech", "maker"):
        said: list[str] = []
        with pytest.raises(MemoryError):
            ran(rig, said)
        assert ticks[-1] == len(load_rig(rig).joints) and on(devices[-1]) == 0, rig
        assert said[-1] == "stopped by fault: unexpected MemoryError: parked, torque off"
        ticks.clear()


def test_an_observer_that_raises_is_left_out_once_and_the_run_goes_on(devices, monkeypatch):
    def broken(self: JointFaults, tick: object) -> None:
        raise RuntimeError("plug-in")

    monkeypatch.setattr(JointFaults, "update", broken)
    said: list[str] = []
    figures = ran("desk", said, 1.0)
    assert figures["stopped_by"] == "seconds" and figures["ticks"] >= 49 and on(devices[0]) == 0
    assert [line for line in said if "plug-in" in line] == [
        "the watch for faults failed (RuntimeError: plug-in); the rig continues without it"
    ]


def test_joints_that_faults_hold_and_servos_silent_at_the_end_are_named(devices, monkeypatch):
    stop = Robot.stop

    def unplugged(self: Robot) -> tuple[str, ...]:
        for servo in (2, 3):
            devices[-1].faults.command(f"lose {servo}")
        return stop(self)

    def jam(made: Run) -> None:
        devices[-1].faults.command("stick 7")

    monkeypatch.setattr(Robot, "stop", unplugged)
    silent = (
        "left_eye_tilt (servo 2), right_eye_pan (servo 3): "
        "torque-off not confirmed: cut the servo power"
    )
    said: list[str] = []
    figures = ran("feetech", said)
    assert figures["joint_faults"] == {} and report_faults(figures, said.append)
    assert said[-1] == f"stopped by seconds: parked, torque off; {silent}"
    figures = ran("desk", said, 2.5, jam)
    assert said[-1] == f"stopped by seconds: not parked, torque off; {silent}"
    about = [line for line in said if "neck_yaw: not moving" in line]
    assert about and about[0].endswith("not moving: held") and len(about) <= 4
    assert figures["joint_faults"]["neck_yaw"]["not moving"] >= 1
    assert report_faults(figures, said.append) and "neck_yaw not moving" in said[-1]


# --- programs of their own


def begun(words: list[str], breaks: str, **options: Any) -> Branch:
    assert not breaks
    return Branch(gazerig(*words), **options)


WAYS = {
    ("desk", "run", "SIGINT"): 20.0,
    ("desk", "run", "SIGHUP"): 20.0,
    ("pca9685", "run", "SIGTERM"): 20.0,
    ("feetech", "jog", "tty closed"): 20.0,
    ("pca9685", "jog", "tty closed"): 20.0,
    ("maker", "jog", "full pipe that nobody reads"): 20.0,
    ("desk", "run", "reader killed"): 6.0,
    ("desk", "run", "stderr broken"): 6.0,
}
"""Longest time, s: a lost reader ends the program before it is asked to end."""
LAST = {"run": "stopped by {}: parked, torque off", "jog": "parked, torque off on all servos"}
"""What is said last, if anybody can read it."""


# Parking takes a bounded time, in which a starved machine does not reach the end.
def test_no_servo_stays_on():
    ways = [way for way in WAYS if is_there(SHIPPED[COMMAND].get(way[1], ""))]
    rows = side_by_side([case(*way, begun, 50.0) for way in ways], 4)
    assert not [
        (way, row)
        for way, row in zip(ways, rows, strict=True)
        if row.void
        or row.on
        or row.code != 0
        or row.seconds > WAYS[way]
        or row.off_park_deg > 6.0
        or row.said not in ("", LAST[way[1]].format(way[2]))
    ]
