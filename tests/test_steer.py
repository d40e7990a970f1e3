"""Steering by hand: what keys mean, and who lets go gives the gaze back."""

from math import degrees

from gazerig.robot.cli.steer import END, KeyControls, run_steering
from gazerig.robot.model.commands import Ask, LookAtDirection, Play
from gazerig.robot.remote.client import RequestRejected
from gazerig.robot.remote.steering import KEYS_LET_GO_S, STOP, Steering


def looked(steering: Steering, t_s: float = 0.0) -> tuple[float, float] | None:
    found = steering.direction_rad(t_s)
    return None if found is None else (round(degrees(found[0]), 2), round(degrees(found[1]), 2))


# ---- what it means


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


# ---- control


class Rig:
    """Stands in for a RobotClient: records its calls."""

    def __init__(self) -> None:
        self.who, self.in_control, self.told = "me", False, list[object]()
        self.refuses = False

    def send(self, command: LookAtDirection | Play | Ask) -> None:
        if isinstance(command, LookAtDirection):
            if self.refuses:
                raise RequestRejected("stopped: resume first")
            self.in_control = True
            self.told.append(tuple(round(degrees(angle)) for angle in command.direction_rad))
        else:
            self.told.append(command.track if isinstance(command, Play) else command.choice)

    def look_freely(self) -> None:
        self.in_control = False
        self.told.append("free")

    def stop(self, why: str) -> None:
        self.told.append(STOP)


class Moves:
    """Controls that do one thing a turn: an arrow (right, up), a press, or nothing for a second."""

    def __init__(self, *turns: tuple[int, int] | str) -> None:
        self._turns = list(turns)

    def update(self, steering: Steering, now_s: float) -> tuple[str, ...]:
        turn = self._turns.pop(0) if self._turns else END
        if isinstance(turn, tuple):
            steering.key(*turn, now_s)
            return ()
        return (turn,) if turn else ()


class Clock:
    def __init__(self) -> None:
        self.t_s = 0.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_until(self, t_s: float) -> None:
        self.t_s = t_s


def led(rig: Rig, *turns: tuple[int, int] | str) -> list[str]:
    shown: list[str] = []
    run_steering(rig, Moves(*turns), Steering(), Clock(), shown.append)  # type: ignore[arg-type]
    return shown


def test_it_tells_each_direction_once_and_lets_go_when_the_keys_do() -> None:
    rig = Rig()
    led(rig, "", (1, 0), "", (0, 1), "nod", "wink", *[""] * 21)
    assert rig.told == [(4, 0), (4, 4), "nod", "wink left", "free"]


def test_stop_goes_before_all_else_and_a_refusal_is_shown() -> None:
    rig = Rig()
    rig.refuses = True
    shown = led(rig, STOP, (1, 0), "nod")
    assert rig.told == [STOP, "nod"]
    assert "stopped: resume first" in shown
