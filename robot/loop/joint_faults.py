"""Report and count of joints that the guard holds because of a fault."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from gazerig.robot.loop.tick import Tick

FAULTS = frozenset(
    {"not moving", "overloaded", "hot", "voltage", "stale joints", "torque off", "not finite"}
)
"""The guard's reasons to hold a faulty joint, in addition to latched errors."""

_PASSING_S = {"stale joints": 0.5, "torque off": 0.5}
"""Duration up to which a loss of answers or a restart is not a fault."""
_BY_TIME = frozenset({"stale joints", "torque off", "not moving"})
"""Reasons that a busy computer can cause."""
_OVER_S = 1.0
"""A fault ends when the joint has not been held for this time; a retry alone does not end it."""


_MOST_NAMED = 3


class JointFault(NamedTuple):
    """A fault of a joint in a run.

    Attributes:
        joint: Name of the joint.
        reason: Reason of the guard.
        times: Number of times that it began.
        seconds: Total duration in s.
    """

    joint: str
    reason: str
    times: int
    seconds: float

    def __str__(self) -> str:
        """Return the fault as text."""
        often = "" if self.times == 1 else f", {self.times} times"
        return f"{self.joint} {self.reason} ({self.seconds:.1f} s{often})"


class _OpenFault:
    """A fault that has not ended."""

    def __init__(self, t_s: float) -> None:
        self.from_s = self.last_s = t_s
        self.reported = False


def joints_text(joints: Sequence[str], count: int = 0) -> str:
    """Return joints as text, at most three by name.

    Args:
        joints: Names of the joints.
        count: Number of the rig's joints.
    """
    if len(joints) == count and count > 1:
        return f"all {count} joints"
    return ", ".join(joints) if len(joints) <= _MOST_NAMED else f"{len(joints)} joints"


class JointFaults:
    """An observer of ticks that counts faults of joints.

    Args:
        report: Receives a line, with the time since the first tick, when a fault begins and ends.
        busy: Returns a text if the computer is too busy, which makes joints stale, otherwise "".
    """

    def __init__(self, report: Callable[[str], None], busy: Callable[[], str] = lambda: "") -> None:
        self._report, self._busy = report, busy
        self._running: dict[tuple[str, str], _OpenFault] = {}
        self._counted: dict[tuple[str, str], tuple[int, float]] = {}
        self._first_s: float | None = None

    def update(self, tick: "Tick") -> None:
        """Check one tick."""
        if self._first_s is None:
            self._first_s = tick.t_s
        guard_result = tick.guard_result
        held = guard_result.level in ("hold", "torque_off") and not tick.stopped
        if not held and not self._running:
            return
        # The same text for several joints is one line.
        lines: dict[tuple[float, str], list[str]] = {}
        for joint, reason in _fault_holds(tick) if held else ():
            running = self._running.setdefault((joint, reason), _OpenFault(tick.t_s))
            running.last_s = tick.t_s
            if not running.reported and tick.t_s - running.from_s >= _PASSING_S.get(reason, 0.0):
                running.reported = True
                busy = self._busy() if reason in _BY_TIME else ""
                text = f"{reason}: held" + f", as {busy}" * bool(busy)
                lines.setdefault((running.from_s, text), []).append(joint)
        for key, running in tuple(self._running.items()):
            if tick.t_s - running.last_s <= _OVER_S:
                continue
            if (seconds := self._end(key, running)) is not None:
                text = f"{key[1]}: over after {seconds:.1f} s"
                lines.setdefault((running.last_s, text), []).append(key[0])
        for (t_s, text), joints in lines.items():
            who = joints_text(joints, len(guard_result.joints))
            self._report(f"{t_s - self._first_s:.2f} s: {who}: {text}")

    def close(self) -> None:
        """Count faults that have not ended, at the end of a run."""
        for key, running in tuple(self._running.items()):
            self._end(key, running)

    def ended_faults(self) -> tuple[JointFault, ...]:
        """Return all faults that have ended, sorted by joint and reason."""
        found = sorted(self._counted.items())
        return tuple(JointFault(*key, times, seconds) for key, (times, seconds) in found)

    def figures(self) -> dict[str, dict[str, dict[str, float]]]:
        """Return these faults as plain values: joint -> reason -> times and seconds."""
        figures: dict[str, dict[str, dict[str, float]]] = {}
        for fault in self.ended_faults():
            entry = {"times": fault.times, "seconds": round(fault.seconds, 3)}
            figures.setdefault(fault.joint, {})[fault.reason] = entry
        return figures

    def _end(self, key: tuple[str, str], running: _OpenFault) -> float | None:
        """Count a fault; return its duration in s, None if it was not reported."""
        del self._running[key]
        if not running.reported:
            return None
        seconds = running.last_s - running.from_s
        times, before_s = self._counted.get(key, (0, 0.0))
        self._counted[key] = times + 1, before_s + seconds
        return seconds


def _fault_holds(tick: "Tick") -> list[tuple[str, str]]:
    """Return joint and reason of all joints that are held because of a fault in this tick."""
    found = []
    faults = tick.joints.fault
    grave = set(tick.guard_result.critical_reasons)
    for i, (joint, why) in enumerate(
        zip(tick.guard_result.joints, tick.guard_result.why, strict=False)
    ):
        if not why or f"{joint}: {why}" not in grave:
            continue
        if why in FAULTS or (faults and why == faults[i]):
            found.append((joint, why))
    return found
