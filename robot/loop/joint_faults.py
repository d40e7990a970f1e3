"""Report and count of joints that the guard holds because of a fault."""

from collections.abc import Callable, Sequence

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


def joints_text(joints: Sequence[str], count: int = 0) -> str:
    """Return joints as text, at most three by name.

    Args:
        joints: Names of the joints.
        count: Number of the rig's joints.
    """
    if len(joints) == count and count > 1:
        return f"all {count} joints"
    return ", ".join(joints) if len(joints) <= _MOST_NAMED else f"{len(joints)} joints"


def fault_text(joints: Sequence[str], reason: str, times: int, seconds: float) -> str:
    """Return a fault in a run as text, e.g. "neck_yaw not moving (2.0 s, 2 times)"."""
    often = "" if times == 1 else f", {times} times"
    return f"{joints_text(joints)} {reason} ({seconds:.1f} s{often})"


class JointFaults:
    """An observer of ticks that counts faults of joints.

    Args:
        report: Receives a line, with the time since the first tick, when a fault begins and ends.
        busy: Returns a text if the computer is too busy, which makes joints stale, otherwise "".
    """

    def __init__(self, report: Callable[[str], None], busy: Callable[[], str] = lambda: "") -> None:
        self._report, self._busy = report, busy
        self._running: dict[tuple[str, str], tuple[float, float]] = {}  # start and last time
        self._reported: set[tuple[str, str]] = set()
        self._counted: dict[str, dict[str, dict[str, float]]] = {}
        self._first_s: float | None = None

    def update(self, tick: Tick) -> None:
        """Check one tick."""
        if self._first_s is None:
            self._first_s = tick.t_s
        held = tick.guard_result.level in ("hold", "torque_off") and not tick.stopped
        if not held and not self._running:
            return
        # The same text for several joints is one line.
        lines: dict[tuple[float, str], list[str]] = {}
        for key in _fault_holds(tick) if held else ():
            joint, reason = key
            start_s, _ = self._running.get(key, (tick.t_s, tick.t_s))
            self._running[key] = start_s, tick.t_s
            passing_s = _PASSING_S.get(reason, 0.0)
            if key not in self._reported and tick.t_s - start_s >= passing_s:
                self._reported.add(key)
                busy = self._busy() if reason in _BY_TIME else ""
                text = f"{reason}: held" + f", as {busy}" * bool(busy)
                lines.setdefault((start_s, text), []).append(joint)
        for key, (_, last_s) in tuple(self._running.items()):
            if tick.t_s - last_s > _OVER_S and (seconds := self._end(key)) is not None:
                text = f"{key[1]}: over after {seconds:.1f} s"
                lines.setdefault((last_s, text), []).append(key[0])
        for (t_s, text), joints in lines.items():
            who = joints_text(joints, len(tick.guard_result.joints))
            self._report(f"{t_s - self._first_s:.2f} s: {who}: {text}")

    def close(self) -> None:
        """Count faults that have not ended, at the end of a run."""
        for key in tuple(self._running):
            self._end(key)

    def figures(self) -> dict[str, dict[str, dict[str, float]]]:
        """Return the faults that have ended: joint -> reason -> times and seconds."""
        return self._counted

    def _end(self, key: tuple[str, str]) -> float | None:
        """Count a fault; return its duration in s, None if it was not reported."""
        start_s, last_s = self._running.pop(key)
        if key not in self._reported:
            return None
        self._reported.remove(key)
        entry = self._counted.setdefault(key[0], {}).setdefault(
            key[1], {"times": 0, "seconds": 0.0}
        )
        entry["times"] += 1
        entry["seconds"] = round(entry["seconds"] + last_s - start_s, 3)
        return last_s - start_s


def _fault_holds(tick: Tick) -> list[tuple[str, str]]:
    """Return joint and reason of all joints that are held because of a fault in this tick."""
    result = tick.guard_result
    faults = tick.joints.fault or ("",) * len(result.joints)
    rows = zip(result.joints, result.why, faults, strict=False)
    return [
        (joint, why)
        for joint, why, fault in rows
        if f"{joint}: {why}" in result.critical_reasons and why in (*FAULTS, fault)
    ]
