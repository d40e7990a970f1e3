"""Whatever ends a command that switched torque on: the head parks and the torque goes off."""

import json
import signal
from collections.abc import Callable
from typing import Any

import pytest
from attack.ways_out import attack, bench
from branch import Branch, gazerig
from features_there import skip_without

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import BusLost, SetupError
from gazerig.robot.cli.run import report_faults
from gazerig.robot.loop.joint_faults import JointFaults
from gazerig.robot.loop.loop import Robot
from gazerig.robot.loop.power_down import SAME_REQUEST_S, Interrupts, PowerDown
from gazerig.robot.run import session
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.sim_mock.device import Device

# --- the door alone


class Head:
    """Something that can be parked and switched off."""

    def __init__(self) -> None:
        self.did: list[str] = []
        self.said: list[str] = []
        self.during_parking: Callable[[], None] = lambda: None
        self.while_off: Callable[[], None] = lambda: None

    def park(self, again: Callable[[], bool]) -> str:
        self.did.append("park")
        self.during_parking()
        return "not parked (interrupted)" if again() else "parked"

    def off(self) -> None:
        self.while_off()
        self.did.append("off")

    def way_out(self, interrupts: Interrupts | None = None) -> PowerDown:
        return PowerDown(
            self.park, self.off, self.said.append, interrupts or Interrupts(), left=": cut it"
        )


@pytest.mark.parametrize(
    "error", [MemoryError(), RuntimeError("x"), KeyboardInterrupt(), SystemExit(3), BusLost("gone")]
)
def test_whatever_ends_the_work_the_head_parks_and_torque_goes_off(error: BaseException):
    head = Head()
    with pytest.raises(type(error)), head.way_out() as leaving:
        leaving.switch_on(lambda: None)
        raise error
    assert head.did == ["park", "off"] and len(head.said) == 1
    assert "parked, torque off" in head.said[0]


@pytest.mark.parametrize("error", [MemoryError(), KeyboardInterrupt(), BusLost("gone")])
def test_parking_that_fails_does_not_keep_the_torque_on(error: BaseException):
    head = Head()

    def fail() -> None:
        raise error

    head.during_parking = fail
    with head.way_out() as leaving:
        leaving.switch_on(lambda: None)
    assert head.did == ["park", "off"] and head.said[0].startswith("not parked (")


def test_torque_that_cannot_be_switched_off_is_said_with_what_to_do():
    head = Head()

    def fail() -> None:
        raise BusLost("no port")

    head.while_off = fail
    leaving = head.way_out()
    with leaving:
        leaving.switch_on(lambda: None)
    assert head.said == ["parked, torque-off could not be sent (no port): cut it"]
    assert leaving.unreleased == ("no port",)


def test_servos_that_do_not_confirm_are_said_even_where_success_is_not():
    head = Head()
    said: list[str] = []

    def off() -> tuple[str, ...]:
        return tuple(f"eye (servo {n}): torque-off not confirmed: cut it" for n in (1, 2, 3))

    with PowerDown(head.park, off, said.append, Interrupts(), quiet=True) as leaving:
        leaving.switch_on(lambda: None)
    eyes = "eye (servo 1), eye (servo 2), eye (servo 3)"
    assert said == [f"parked, torque off; {eyes}: torque-off not confirmed: cut it"]


def test_a_start_that_is_refused_needs_no_end_and_one_that_breaks_off_does():
    def refused() -> None:
        raise SetupError("no servo")

    def broken() -> None:
        raise MemoryError

    for start, did in ((refused, []), (broken, ["off"])):
        head = Head()
        with pytest.raises((SetupError, MemoryError)), head.way_out() as leaving:
            leaving.switch_on(start)
        assert head.did == did and head.said == []


class Seconds:
    """A clock that is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def ask(clock: Seconds, number: signal.Signals = signal.SIGINT, after_s: float = 1.0) -> None:
    clock.now += after_s
    signal.raise_signal(number)


def test_a_second_request_skips_parking_and_none_reaches_the_torque_off():
    head, clock = Head(), Seconds()
    head.during_parking = lambda: ask(clock)

    def impatient() -> None:
        for _ in range(5):
            ask(clock)

    head.while_off = impatient
    with Interrupts(clock) as interrupts, head.way_out(interrupts) as leaving:
        leaving.switch_on(lambda: None)
        ask(clock)
        leaving.cause = interrupts() or ""
    assert head.did == ["park", "off"]
    assert head.said == ["stopped by SIGINT: not parked (interrupted), torque off"]


def test_parking_that_hangs_is_broken_off_by_one_more():
    head, clock = Head(), Seconds()

    def hang() -> None:
        for _ in range(3):
            ask(clock)
        raise AssertionError("nobody broke it off")

    head.during_parking = hang
    with Interrupts(clock) as interrupts, head.way_out(interrupts) as leaving:
        leaving.switch_on(lambda: None)
        ask(clock)
    assert head.did == ["park", "off"] and "not parked (interrupted)" in head.said[0]


def test_signals_of_one_closed_terminal_are_one_request():
    clock = Seconds()
    with Interrupts(clock) as interrupts:
        ask(clock, signal.SIGHUP)
        ask(clock, signal.SIGHUP)
        assert interrupts() == "SIGHUP" and interrupts.requests == 1
    with Interrupts(clock) as interrupts:
        ask(clock, signal.SIGTERM)
        ask(clock, signal.SIGTERM, 0.5 * SAME_REQUEST_S)
        assert interrupts.requests == 1
        with pytest.raises(KeyboardInterrupt):
            ask(clock, signal.SIGTERM)


def test_handlers_are_put_back_and_nohup_is_heeded():
    numbers = (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTTOU)
    before = [signal.getsignal(number) for number in numbers]
    with Interrupts() as interrupts, interrupts:
        assert [signal.getsignal(number) for number in numbers] != before
    assert [signal.getsignal(number) for number in numbers] == before
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupts():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


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
