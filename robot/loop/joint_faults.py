"""Report and count of joints that the guard holds because of a fault."""

from collections.abc import Callable, Sequence

from gazerig.robot.loop.tick import Tick

FAULTS = frozenset(
    {"not moving", "overloaded", "hot", "voltage", "stale joints", "torque off", "not finite"}
)
"""The guard's reasons to hold a faulty joint, in addition to latched errors."""
_PASSING_S = {"stale joints": 0.5, "torque off": 0.5}
"""Duration up to which a loss of answers or a restart is not a fault."""
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


class JointFaults:
    """An observer of ticks that names and counts the faults of joints.

    Attributes:
        counts: Number of faults, joint -> reason.

    Args:
        report: Receives a line, with the time since the first tick, when a fault begins.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._running: dict[tuple[str, str], tuple[float, float]] = {}  # start and last time
        self._reported: set[tuple[str, str]] = set()
        self.counts: dict[str, dict[str, int]] = {}
        self._first_s: float | None = None

    def update(self, tick: Tick) -> None:
        """Check one tick."""
        if self._first_s is None:
            self._first_s = tick.t_s
        held = tick.guard_result.level in ("hold", "torque_off") and not tick.stopped
        begun: dict[str, list[str]] = {}
        for key in _fault_holds(tick) if held else ():
            joint, reason = key
            start_s, _ = self._running.get(key, (tick.t_s, tick.t_s))
            self._running[key] = start_s, tick.t_s
            if key not in self._reported and tick.t_s - start_s >= _PASSING_S.get(reason, 0.0):
                self._reported.add(key)
                begun.setdefault(reason, []).append(joint)
                reasons = self.counts.setdefault(joint, {})
                reasons[reason] = reasons.get(reason, 0) + 1
        for key, (_, last_s) in tuple(self._running.items()):
            if tick.t_s - last_s > _OVER_S:
                del self._running[key]
                self._reported.discard(key)
        for reason, joints in begun.items():
            who = joints_text(joints, len(tick.guard_result.joints))
            self._report(f"{tick.t_s - self._first_s:.2f} s: {who}: {reason}: held")


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
