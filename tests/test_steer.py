"""Steering by hand: what keys, sticks and buttons mean, and who lets go gives the gaze back."""

from collections.abc import Callable
from math import degrees
from types import SimpleNamespace
from typing import Any

import pytest

from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.steer import END, KeyControls, run_steering
from gazerig.robot.model.commands import LookAtDirection
from gazerig.robot.remote.client import RequestRejected
from gazerig.robot.remote.gamepad import Gamepad, open_gamepad
from gazerig.robot.remote.steering import KEYS_LET_GO_S, STOP, Steering, Stick

KEY, ABS, SOUTH, START, X, Y, HAT_X = 1, 3, 0x130, 0x13B, 0, 1, 16


def looked(steering: Steering, t_s: float = 0.0) -> tuple[float, float] | None:
    found = steering.direction_rad(t_s)
    return None if found is None else (round(degrees(found[0]), 2), round(degrees(found[1]), 2))


# ---- what it means


def test_a_stick_at_rest_lets_go_and_one_at_its_end_looks_as_far_as_it_goes() -> None:
    steering = Steering()
    for x, y in ((0.0, 0.0), (0.1, -0.1)):
        steering.stick(Stick(x, y))
        assert looked(steering) is None
    steering.stick(Stick(1.0, 0.0))
    assert looked(steering) == (50.0, 0.0)  # to the person's right, which is its left
    steering.stick(Stick(0.0, -1.0))
    assert looked(steering) == (0.0, -30.0)
    steering.stick(Stick(0.16, 0.0))
    at = looked(steering)
    assert at is not None and 0.0 < at[0] < 1.0  # no jump at the edge of rest


def test_arrow_keys_add_up_and_let_go_when_none_comes() -> None:
    steering = Steering()
    steering.key(1, 0, 10.0)
    steering.key(1, 1, 10.5)
    assert looked(steering, 10.6) == (8.0, 4.0)
    assert looked(steering, 10.5 + KEYS_LET_GO_S) is None
    steering.key(-1, 0, 20.0)  # begins ahead again
    assert looked(steering, 20.0) == (-4.0, 0.0)
    for _ in range(100):
        steering.key(-1, -1, 20.0)
    assert looked(steering, 20.0) == (-50.0, -30.0)


def test_keys_of_a_terminal() -> None:
    typed: list[str | None] = ["\x1b[C\x1b[C\x1b[A", "5 ", "\x1b", "[Dq", None]
    steering, keys = Steering(), KeyControls(lambda: typed.pop(0))
    assert keys.update(steering, 1.0) == ()
    assert looked(steering, 1.0) == (8.0, 4.0)
    assert keys.update(steering, 1.0) == ("sleepy", STOP)
    assert keys.update(steering, 1.0) == ()  # a sequence that is not whole yet
    assert keys.update(steering, 1.0) == (END,)
    assert looked(steering, 1.0) == (4.0, 4.0)
    assert keys.update(steering, 1.0) == (END,)  # the terminal is gone


# ---- a gamepad


class Device:
    """Stands in for evdev.InputDevice: a gamepad, or a keyboard."""

    def __init__(self, pad: bool = True) -> None:
        self.name = "Pad" if pad else "Keys"
        self.events: list[tuple[int, int, int]] = []
        self.gone = self.closed = False
        axis = SimpleNamespace(min=0, max=255)
        hat = SimpleNamespace(min=-1, max=1)
        self._can = {KEY: [SOUTH, START], ABS: [(X, axis), (Y, axis), (HAT_X, hat)]}
        if not pad:
            self._can = {KEY: [30]}

    def capabilities(self) -> dict[int, Any]:
        return self._can

    def read_one(self) -> Any:
        if self.gone:
            raise OSError(19, "No such device")
        if not self.events:
            return None
        kind, code, value = self.events.pop(0)
        return SimpleNamespace(type=kind, code=code, value=value)

    def close(self) -> None:
        self.closed = True


def evdev(*devices: Device) -> Callable[[], Any]:
    named = {f"/dev/input/event{i}": device for i, device in enumerate(devices)}
    return lambda: SimpleNamespace(
        list_devices=lambda: list(named), InputDevice=lambda path: named[path]
    )


def test_stick_hat_and_buttons() -> None:
    device = Device()
    pad = Gamepad(device)
    assert pad.news() == (Stick(0.0, 0.0), ())
    device.events = [(ABS, X, 255), (ABS, Y, 0), (KEY, SOUTH, 1), (KEY, SOUTH, 0), (KEY, START, 1)]
    assert pad.news() == (Stick(1.0, 1.0), ("nod", STOP))  # evdev's y is down
    device.events = [(ABS, X, 127), (ABS, Y, 128), (ABS, HAT_X, -1), (KEY, 0x2FF, 1), (0, 0, 0)]
    stick, pressed = pad.news()
    assert stick.x == -1.0 and abs(stick.y) < 0.01 and pressed == ()
    device.events = [(ABS, HAT_X, 0)]
    assert abs(pad.news().stick.x) < 0.01


@pytest.mark.parametrize("path", [None, "/dev/input/event0"])
def test_no_gamepad_is_one_clear_line(path: str | None) -> None:
    with pytest.raises(SetupError, match="gamepad.*plug one in"):
        open_gamepad(path, evdev(Device(pad=False)))


# ---- control


class Rig:
    """Stands in for a RobotClient: records its calls."""

    def __init__(self) -> None:
        self.who, self.in_control, self.told = "me", False, list[object]()
        self.refuses = False

    def send(self, command: LookAtDirection) -> None:
        if self.refuses:
            raise RequestRejected("stopped: resume first")
        self.in_control = True
        self.told.append(tuple(round(degrees(angle)) for angle in command.direction_rad))

    def look_freely(self) -> None:
        self.in_control = False
        self.told.append("free")

    def play(self, track: str) -> None:
        self.told.append(track)

    def ask(self, menu: str, choice: str) -> None:
        self.told.append(choice)

    def stop(self, why: str) -> None:
        self.told.append(STOP)


class Moves:
    """Controls that do one thing a turn: a stick or a press."""

    def __init__(self, *turns: Stick | str) -> None:
        self._turns = list(turns)

    def update(self, steering: Steering, now_s: float) -> tuple[str, ...]:
        turn = self._turns.pop(0) if self._turns else END
        if isinstance(turn, Stick):
            steering.stick(turn)
            return ()
        return (turn,)


class Clock:
    def __init__(self) -> None:
        self.t_s = 0.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_until(self, t_s: float) -> None:
        self.t_s = t_s


def led(rig: Rig, *turns: Stick | str) -> list[str]:
    shown: list[str] = []
    run_steering(rig, Moves(*turns), Steering(), Clock(), shown.append)  # type: ignore[arg-type]
    return shown


def test_it_tells_each_direction_once_and_lets_go_when_the_stick_does() -> None:
    rig = Rig()
    right, up, rest = Stick(1.0, 0.0), Stick(0.0, 1.0), Stick()
    led(rig, rest, right, right, up, "nod", "wink", rest, rest)
    assert rig.told == [(50, 0), (0, 30), "nod", "wink left", "free"]


def test_stop_goes_before_all_else_and_a_refusal_is_shown() -> None:
    rig = Rig()
    rig.refuses = True
    shown = led(rig, STOP, Stick(1.0, 0.0), "nod")
    assert rig.told == [STOP, "nod"]
    assert "stopped: resume first" in shown
