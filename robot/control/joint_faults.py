"""Report and count of joints that the guard holds because of a fault."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from gazerig.robot.control.tick import Tick

FAULTS = frozenset(
    {"not moving", "overloaded", "hot", "voltage", "stale joints", "torque off", "not finite"}
)
"""The guard's reasons to hold a faulty joint, in addition to latched errors."""

_PASSING_S = {"stale joints": 0.5, "torque off": 0.5}
"""A shorter loss of answers or restart is no fault."""
_BY_TIME = frozenset({"stale joints", "torque off", "not moving"})
"""Reasons that a late computer can cause."""
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


class _Lines:
    """The lines about joints of one tick; the same text for several joints is one line."""

    def __init__(self) -> None:
        self._joints: dict[tuple[float, str], list[str]] = {}

    def add(self, joint: str, t_s: float, what: str) -> None:
        """Add a text about a joint at a time."""
        self._joints.setdefault((t_s, what), []).append(joint)

    def all(self, count: int) -> list[tuple[float, str]]:
        """Return time and text of each line.

        Args:
            count: Number of the rig's joints.
        """
        return [(t_s, f"{named(of, count)}: {what}") for (t_s, what), of in self._joints.items()]


def named(joints: Sequence[str], count: int = 0) -> str:
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
        say: Receives a line, with the time since the first tick, when a fault begins and ends.
        busy: Returns a text if the computer is too busy, which makes joints stale, else "".
    """

    def __init__(self, say: Callable[[str], None], busy: Callable[[], str] = lambda: "") -> None:
        self._say, self._busy = say, busy
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
        lines = _Lines()
        for joint, reason in _fault_holds(tick) if held else ():
            running = self._running.setdefault((joint, reason), _OpenFault(tick.t_s))
            running.last_s = tick.t_s
            if not running.reported and tick.t_s - running.from_s >= _PASSING_S.get(reason, 0.0):
                running.reported = True
                busy = self._busy() if reason in _BY_TIME else ""
                lines.add(joint, running.from_s, f"{reason}: held" + (f", as {busy}" * bool(busy)))
        for key, running in tuple(self._running.items()):
            if tick.t_s - running.last_s > _OVER_S:
                self._end(key, running, lines)
        for t_s, line in lines.all(len(guard_result.joints)):
            self._say(f"{t_s - self._first_s:.2f} s: {line}")

    def close(self) -> None:
        """Count faults that have not ended, at the end of a run."""
        for key, running in tuple(self._running.items()):
            self._end(key, running, None)

    def counted(self) -> tuple[JointFault, ...]:
        """Return all faults that have ended, sorted by joint and reason."""
        found = sorted(self._counted.items())
        return tuple(JointFault(*key, times, seconds) for key, (times, seconds) in found)

    def figures(self) -> dict[str, dict[str, dict[str, float]]]:
        """Return these faults as plain values: joint -> reason -> times and seconds."""
        figures: dict[str, dict[str, dict[str, float]]] = {}
        for fault in self.counted():
            entry = {"times": fault.times, "seconds": round(fault.seconds, 3)}
            figures.setdefault(fault.joint, {})[fault.reason] = entry
        return figures

    def _end(self, key: tuple[str, str], running: _OpenFault, lines: "_Lines | None") -> None:
        """Count a fault.

        Args:
            key: Joint and reason.
            running: The fault.
            lines: Receives the line about its end; None at the end of a run.
        """
        del self._running[key]
        if not running.reported:
            return
        seconds = running.last_s - running.from_s
        times, before_s = self._counted.get(key, (0, 0.0))
        self._counted[key] = times + 1, before_s + seconds
        if lines is not None:
            joint, reason = key
            lines.add(joint, running.last_s, f"{reason}: over after {seconds:.1f} s")


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
