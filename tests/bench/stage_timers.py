"""Timers around the stages of a running loop, and what they found."""

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gazerig.robot.control.loop import TickLoop

STAGES = {
    "commands": ("_obey",),
    "read": ("body.read",),
    "forward": ("_kinematics.forward",),
    "camera": ("camera.latest",),
    "see": ("perception.see",),
    "choose": ("attention.choose",),
    "wander": ("_scanpath.wander", "_aversion.step"),
    "plan": ("_animation.step", "_oculomotor.step"),
    "inverse": ("_kinematics.inverse",),
    "guard": ("_guard.check",),
    "write": ("body.write",),
}
"""Stage -> what of the robot it calls."""
TURN, COUNTED = 16, 3
"""So many ticks with timers follow as many without: a burst of other load hits both alike."""
now_ns = time.thread_time_ns


class Timers:
    """Timers around the stages of one loop, to be put on and taken off while it runs.

    spent_ns: of the present tick, stage by stage; calls: how many were timed in it
    """

    def __init__(self, loop: TickLoop) -> None:
        self.names = (*STAGES, "observers", "wait")
        self.spent_ns = [0] * len(self.names)
        self.calls = 0
        self._timed = False
        self._on: list[Callable[[], None]] = []
        self._off: list[Callable[[], None]] = []
        self.absent: list[str] = []
        robot: Any = loop._robot
        for at, paths in enumerate(STAGES.values()):
            for path in paths:
                self._add(robot, path, at)
        self._add(loop, "_watch", len(STAGES))
        self._add(loop, "_clock.sleep_until", len(STAGES) + 1)

    def _add(self, root: object, path: str, at: int) -> None:
        """Prepare a timer around one method; as it may have slots, else on its class."""
        *way, verb = path.split(".")
        owner = root
        for name in way:
            owner = getattr(owner, name, None)
        plain = getattr(owner, verb, None)
        if plain is None:
            self.absent.append(path)
            return
        timed = self.timed(plain, at)
        if hasattr(owner, "__dict__"):
            kept = owner.__dict__.get(verb)
            self._on.append(lambda: setattr(owner, verb, timed))
            self._off.append(
                (lambda: delattr(owner, verb))
                if kept is None
                else (lambda: setattr(owner, verb, kept))
            )
        else:
            of_class, held = type(owner), type(owner).__dict__[verb]
            self._on.append(lambda: setattr(of_class, verb, lambda _, *args: timed(*args)))
            self._off.append(lambda: setattr(of_class, verb, held))

    def timed(self, work: Callable[..., Any], at: int) -> Callable[..., Any]:
        """Return a function with a timer around it."""
        spent_ns = self.spent_ns

        def wrapped(*args: Any) -> Any:
            began = now_ns()
            result = work(*args)
            spent_ns[at] += now_ns() - began
            self.calls += 1
            return result

        return wrapped

    def put(self, on: bool) -> None:
        """Put all on, or take them off."""
        if on != self._timed:
            self._timed = on
            for change in self._on if on else self._off:
                change()

    def begin(self) -> None:
        """Forget the tick before."""
        self.spent_ns[:] = [0] * len(self.names)
        self.calls = 0

    def own_ns(self) -> tuple[float, float]:
        """Return the cost of a timer: what it adds to its stage, and outside it."""
        count, plain = 2000, lambda *_: None
        timed = self.timed(plain, 0)
        inside, whole = [], []
        for _ in range(15):
            self.begin()
            began = now_ns()
            for _ in range(count):
                plain(None, None)
            bare = now_ns() - began
            began = now_ns()
            for _ in range(count):
                timed(None, None)
            both = now_ns() - began
            inside.append((self.spent_ns[0] - bare) / count)
            whole.append((both - bare) / count)
        self.begin()
        inner = max(0.0, float(np.median(inside)))
        return inner, max(0.0, float(np.median(whole)) - inner)


class Noted:
    """Times of the ticks: whole, stage by stage, with and without timers."""

    def __init__(self) -> None:
        self.whole: list[tuple[bool, bool, int]] = []
        self.stages: list[list[int]] = []
        self.calls: list[int] = []
        self.starts_s: list[float] = []
        self.counted: list[tuple[bool, int]] = []


def follow(loop: TickLoop, timers: Timers, noted: Noted, seconds: float) -> None:
    """Step a loop: some ticks without timers, some with, and some whose calls are counted."""
    robot: Any = loop._robot
    perception, rate_hz = robot.perception, round(loop._params().rate_hz)
    calls = 0

    def called(frame: object, event: str, arg: object) -> None:
        nonlocal calls
        calls += event == "call"

    for k in range(round(seconds * rate_hz)):
        phase = k % (2 * TURN + COUNTED)
        counted, on = phase >= 2 * TURN, TURN <= phase < 2 * TURN
        timers.put(on)
        frames, calls = perception.frames, 0
        timers.begin()
        if counted:
            sys.setprofile(called)
        began = now_ns()
        reason = loop.step()
        spent = now_ns() - began
        sys.setprofile(None)
        if reason is not None:
            raise SystemExit(f"the run ended: {reason}")
        noted.starts_s.append(loop._last_s)
        new = perception.frames != frames
        if counted:
            noted.counted.append((new, calls))
            continue
        noted.whole.append((on, new, spent))
        if on:
            noted.stages.append(list(timers.spent_ns))
            noted.calls.append(timers.calls)
    timers.put(False)


def summed(noted: Noted, timers: Timers, own_ns: tuple[float, float]) -> dict[str, Any]:
    """Return stages and whole ticks in microseconds, and calls a tick."""
    inner, outer = own_ns
    plain = [(new, spent / 1e3) for on, new, spent in noted.whole if not on]
    with_on = [(new, spent / 1e3) for on, new, spent in noted.whole if on]
    new = np.array([new for new, _ in with_on])
    spent = np.array(noted.stages) / 1e3
    calls = np.array(noted.calls)
    per_call = calls.mean() / max(1, (spent > 0).sum(axis=1).mean())
    less = np.where(spent > 0, inner / 1e3 * per_call, 0.0)
    clean = np.maximum(0.0, spent - less)
    whole = np.array([us for _, us in with_on]) - calls * (inner + outer) / 1e3
    rest = whole - clean.sum(axis=1)
    rows = {name: clean[:, at] for at, name in enumerate(timers.names)} | {"rest": rest}
    stages = {name: quantiles(row) | with_new(row, new) for name, row in rows.items()}
    total = np.array([us for _, us in plain])
    total_new = np.array([new for new, _ in plain])
    stages["whole tick"] = quantiles(total) | with_new(total, total_new)
    counted = np.array([n for _, n in noted.counted], float)
    counted_new = np.array([new for new, _ in noted.counted])
    return {
        "stages_us": stages,
        "calls": quantiles(counted) | with_new(counted, counted_new),
        "timers_left_us": float(whole.mean() - total.mean()),
    }


def quantiles(values: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Return mean, median and 99th percentile."""
    p50, p99 = np.percentile(values, (50, 99))
    return {"mean": float(np.mean(values)), "p50": float(p50), "p99": float(p99)}


def with_new(values: np.ndarray, new: np.ndarray) -> dict[str, float]:
    """Return mean and 99th percentile of the ticks with a new frame."""
    if not new.any():
        return {}
    return {"new mean": float(values[new].mean()), "new p99": float(np.percentile(values[new], 99))}
