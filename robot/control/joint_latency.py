"""Latency of joints: the time from a command to its measured motion, estimated while they move."""

from collections.abc import Sequence
from math import radians

import numpy as np

from gazerig.robot.model.types import JointAngles, JointState

_BATCH = 64
"""Ticks that are evaluated together."""
_FRESH_S = 0.05
_ENOUGH = radians(1.0) ** 2 * 2000.0
"""Integral of the squared speed from which a latency counts: e.g. 100 deg/s for .2 s."""
_KEPT = 50.0
"""Multiple of it at which older motion loses half its weight."""
_LONGEST_S = 0.2


class JointLatency:
    """The latency of every joint.

    A joint that moves with speed v is behind its command by v times its latency, so the latency is
    the slope of the linear regression of the error on the speed. It needs no memory of the motion,
    and constant errors (play, weight) do not change it.

    Args:
        buses: Name of each joint's bus.
    """

    def __init__(self, buses: Sequence[str]) -> None:
        self._rows: list[tuple[float, JointAngles, JointState]] = []
        # Weight, speed, error, speed squared and speed times error; one column per joint.
        self._sums = np.zeros((5, len(buses)))
        self._same_bus = np.array([[one == other for other in buses] for one in buses])

    def add(self, t_s: float, command_rad: JointAngles, joints: JointState) -> None:
        """Record a tick: the joints, which were read first, and the command sent to them.

        A reading without the state of the torque counts for nothing.
        """
        if not (joints.torque and joints.measured):
            return
        self._rows.append((t_s, command_rad, joints))
        if len(self._rows) >= _BATCH:
            self._evaluate()
            del self._rows[:-2]

    def interrupt(self) -> None:
        """Forget the unevaluated ticks, as the joints do not follow commands now."""
        self._rows.clear()

    def _evaluate(self) -> None:
        times = np.array([t_s for t_s, _, _ in self._rows])[:, None]
        commands = np.array([command for _, command, _ in self._rows])
        states = [joints for _, _, joints in self._rows[1:-1]]
        read_s = np.array([one.measured_s for one in states])
        valid = np.array([one.torque for one in states]) & np.array(
            [one.measured for one in states]
        )
        valid &= times[1:-1] - read_s < _FRESH_S
        between_s = times[2:] - times[:-2]
        speed = (commands[2:] - commands[:-2]) / between_s
        with np.errstate(invalid="ignore"):
            error = commands[1:-1] - np.array([one.position_rad for one in states])
            error += speed * (read_s - times[1:-1])
        valid &= np.isfinite(error) & np.isfinite(speed)
        weight = np.where(valid, 0.5 * between_s, 0.0)
        speed, error = np.where(valid, speed, 0.0), np.where(valid, error, 0.0)
        columns = (np.ones_like(speed), speed, error, speed * speed, speed * error)
        self._sums += [(weight * column).sum(axis=0) for column in columns]
        self._sums[:, self._sums[3] > _KEPT * _ENOUGH] *= 0.5

    def estimates_s(self, default_s: float) -> tuple[float, ...]:
        """Return the latency of every joint, in ms accuracy.

        It is the joint's own; until it has moved enough, that of all joints of its bus; until they
        have, the default.
        """
        weight, speed, error, squares, products = self._sums
        weight = np.maximum(weight, 1e-9)
        moved = squares - speed * speed / weight
        lagged = products - speed * error / weight
        found = np.full(len(moved), default_s)
        for of in (self._same_bus, np.eye(len(moved))):
            enough = moved @ of > _ENOUGH
            found[enough] = (lagged @ of)[enough] / (moved @ of)[enough]
        return tuple([round(one, 3) for one in found.clip(0.0, _LONGEST_S).tolist()])
