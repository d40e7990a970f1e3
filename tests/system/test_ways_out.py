"""Whatever ends a command that switched torque on: the head parks and the torque goes off."""

import json
from collections.abc import Callable
from typing import Any

import pytest
from attack.ways_out import attack, bench
from branch import Branch, gazerig
from features_there import skip_without

from gazerig.config.schema import load_rig
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
    made = Run(load_rig(rig), options)
    if before is not None:
        before(made)
    return session.Session(made, lambda: None, said.append).run()


@pytest.mark.parametrize("rig", ["desk", "feetech", "maker"])
def test_no_memory_in_the_loop_leaves_by_the_door(
    rig: str, devices: list[Device], monkeypatch: pytest.MonkeyPatch
):
    tick, ticks = Robot.tick, []

    def short_of_memory(self: Robot, *words: Any) -> object:
        ticks.append(on(devices[0]))
        if len(ticks) > 100:
            raise MemoryError
        return tick(self, *words)

    monkeypatch.setattr(Robot, "tick", short_of_memory)
    said: list[str] = []
    with pytest.raises(MemoryError):
        ran(rig, said)
    assert ticks[-1] == len(load_rig(rig).joints) and on(devices[0]) == 0
    assert said[-1] == "stopped by fault: unexpected MemoryError: parked, torque off"


def test_an_observer_that_raises_is_left_out_once_and_the_run_goes_on(
    devices: list[Device], monkeypatch: pytest.MonkeyPatch
):
    def broken(self: JointFaults, tick: object) -> None:
        raise RuntimeError("plug-in")

    monkeypatch.setattr(JointFaults, "update", broken)
    said: list[str] = []
    figures = ran("desk", said, 1.0)
    assert figures["stopped_by"] == "seconds" and figures["ticks"] >= 199 and on(devices[0]) == 0
    assert [line for line in said if "plug-in" in line] == [
        "the watch for faults failed (RuntimeError: plug-in); the rig continues without it"
    ]


@pytest.mark.parametrize("rig", ["desk", "feetech"])
def test_servos_that_go_silent_at_the_end_are_named(
    rig: str, devices: list[Device], monkeypatch: pytest.MonkeyPatch
):
    stop = Robot.stop

    def unplugged(self: Robot) -> tuple[str, ...]:
        for servo in (2, 3):
            devices[0].faults.command(f"lose {servo}")
        return stop(self)

    monkeypatch.setattr(Robot, "stop", unplugged)
    said: list[str] = []
    figures = ran(rig, said, 1.0)
    assert figures["joint_faults"] == {} and report_faults(figures, said.append)
    assert said[-1] == (
        "stopped by seconds: parked, torque off; "
        "left_eye_tilt (servo 2), right_eye_pan (servo 3): "
        "torque-off not confirmed: cut the servo power"
    )


# --- joints that faults hold


def test_a_joint_that_does_not_move_is_said_counted_and_in_the_exit_code(
    devices: list[Device],
):
    said: list[str] = []

    def jam(made: Run) -> None:
        devices[0].faults.command("stick 7")

    figures = ran("desk", said, 8.0, jam)
    about = [line for line in said if "neck_yaw: not moving" in line]
    assert about and about[0].endswith("not moving: held") and len(about) <= 4
    assert figures["joint_faults"]["neck_yaw"]["not moving"] >= 1
    last: list[str] = []
    assert report_faults(figures, last.append)
    assert "neck_yaw not moving" in last[0]


# --- programs of their own


def begun(words: list[str], breaks: str, **options: Any) -> Branch:
    assert not breaks
    return Branch(gazerig(*words), **options)


# Parking takes a bounded time, in which a starved machine does not reach the end.
@pytest.mark.parametrize(
    ("rig", "command", "way"),
    [
        ("desk", "run", "SIGHUP"),
        ("feetech", "jog", "tty closed"),
        ("maker", "jog", "full pipe that nobody reads"),
        ("pca9685", "run", "SIGTERM"),
        ("pca9685", "jog", "tty closed"),
        ("desk", "run", "reader killed"),
        ("desk", "run", "stderr broken"),
    ],
)
def test_no_servo_stays_on(rig: str, command: str, way: str):
    skip_without(command)
    with bench(rig, 50.0) as at:
        row = attack(at, command, way, begun)
    assert not row.void and row.code is not None and row.on == 0, row
    assert row.off_park_deg < 6.0, row
