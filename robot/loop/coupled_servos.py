"""Conversion for pairs of servos that together move two joints."""

from collections.abc import Iterable, Sequence
from typing import TypeVar

from gazerig.drivers.types import Feedback
from gazerig.robot.model.coupling import CouplingParams


class CoupledServos:
    """The coupled pairs of one body.

    Args:
        pairs: The pairs with the names of their joints.
        names: Names of all joints in their order.
    """

    def __init__(self, pairs: Iterable[CouplingParams], names: Sequence[str]) -> None:
        # The positions of both joints in every sequence, and their coupling.
        self._pairs = tuple((names.index(one.first), names.index(one.second), one) for one in pairs)
        self._last: dict[int, Feedback] = {}

    def joints(self, shafts_rad: Sequence[float]) -> list[float]:
        """Return the joint angles of servo angles, or the joint speeds of servo speeds."""
        angles = list(shafts_rad)
        for i, j, coupling in self._pairs:
            angles[i], angles[j] = coupling.joint_rad((shafts_rad[i], shafts_rad[j]))
        return angles

    def shafts(self, joints_rad: Sequence[float]) -> list[float]:
        """Return the servo angles of joint angles."""
        angles = list(joints_rad)
        for i, j, coupling in self._pairs:
            angles[i], angles[j] = coupling.servo_rad((joints_rad[i], joints_rad[j]))
        return angles

    def share_feedback(self, feedback: Feedback, released: bool) -> Feedback:
        """Return feedback in which both servos of a pair share the values for both joints.

        If one servo did not answer, both joints are stale, at their last common position. The
        higher load, a fault, and torque that was switched on again apply to both. The torque is on
        if both servos have it; after a release (``released``), if one has it.
        """
        for i, j, _ in self._pairs:
            feedback = self._complete(feedback, i, j, released)
        return feedback

    def _complete(self, now: Feedback, i: int, j: int, released: bool) -> Feedback:
        absent = bool(now.missing) and (i in now.missing or j in now.missing)
        if not absent:
            self._last[i] = now
        last = self._last.get(i, now)
        oldest = min(last.at_s[i], last.at_s[j])
        load_i, load_j = now.load[i], now.load[j]
        load = load_j if abs(load_j) > abs(load_i) else load_i
        on_i, on_j = now.torque[i], now.torque[j]
        powered = on_i or on_j if released else on_i and on_j
        anew = now.rearmed[i] or now.rearmed[j]
        fault = now.fault[i] or now.fault[j]
        shared = f"{fault} (of its coupled servo)" if fault else ""
        now = now._replace(
            at_s=_replace_pair(now.at_s, i, oldest, j, oldest),
            load=_replace_pair(now.load, i, load, j, load),
            torque=_replace_pair(now.torque, i, powered, j, powered),
            rearmed=_replace_pair(now.rearmed, i, anew, j, anew),
            fault=_replace_pair(now.fault, i, now.fault[i] or shared, j, now.fault[j] or shared),
        )
        if not absent:
            return now
        steps, speeds = last.position_steps, last.velocity_steps_s
        return now._replace(
            missing=tuple(sorted({*now.missing, i, j})),
            position_steps=_replace_pair(now.position_steps, i, steps[i], j, steps[j]),
            velocity_steps_s=_replace_pair(now.velocity_steps_s, i, speeds[i], j, speeds[j]),
        )


T = TypeVar("T")


def _replace_pair(values: tuple[T, ...], i: int, at_i: T, j: int, at_j: T) -> tuple[T, ...]:
    """Return values with two of them replaced; the same tuple if nothing changes."""
    if values[i] == at_i and values[j] == at_j:
        return values
    changed = list(values)
    changed[i], changed[j] = at_i, at_j
    return tuple(changed)
