"""Couplings of two servos that together move two joints: differential, push rods, measured table.

The joints are called first and second, the servos a and b. All angles are in rad; those of the
servos are at their shafts, after sign, ratio and zero. The usual pair is a neck's pitch and roll.
"""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import acos, atan2, cos, floor, hypot, isfinite, pi, sin
from typing import Protocol

from gazerig.gaze.types import Vec3

Pair = tuple[float, float]
Rates = tuple[Pair, Pair]
"""Rotation of servo a and of servo b per rad of the first and of the second joint."""


class Unreachable(ValueError):
    """Joint angles that no servo angles can produce; the message gives the reason."""


class Coupling(Protocol):
    """A mechanism between two servos and two joints."""

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles.

        Raises:
            Unreachable: There are none.
        """
        ...

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles; for impossible ones, any finite angles."""
        ...

    def rates(self, joints: Pair) -> Rates:
        """Return the servo speeds per joint speed at joint angles.

        Raises:
            Unreachable: There are no servo angles.
        """
        ...


class Differential:
    """Bevel gears: the servos' sum turns the first joint, their difference the second.

    Args:
        first_ratio: Turns of the servos for one turn of the first joint.
        second_ratio: Turns of the servos, in opposite directions, for one of the second.
    """

    def __init__(self, first_ratio: float = 1.0, second_ratio: float = 1.0) -> None:
        self._first, self._second = first_ratio, second_ratio

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles."""
        both, against = self._first * joints[0], self._second * joints[1]
        return both + against, both - against

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles."""
        a, b = servos
        return 0.5 * (a + b) / self._first, 0.5 * (a - b) / self._second

    def rates(self, joints: Pair) -> Rates:
        """Return the servo speeds per joint speed, which are constant."""
        return (self._first, self._second), (self._first, -self._second)


_NEAR_LINE = 0.98
"""Sine of the angle between rod and horn above which the rod transmits no force and has two
solutions.
"""


class PushRods:
    """Two servos with horns and rods of fixed length, left and right of a head on a joint.

    Frame of the neck's pitch axis: x ahead, y left, z up; the first joint is pitch, the second
    roll. The horns turn about axes parallel to y; at 0 they are level.

    Args:
        anchor_m: Left rod's anchor on the level head; the right one is mirrored.
        servo_m: Axis of the left servo's horn; the right one is mirrored.
        horn_m: Length of the horns, negative if they point back.
        rod_m: Length of the rods.

    Raises:
        Unreachable: The rods do not fit with the head level.
    """

    def __init__(self, anchor_m: Vec3, servo_m: Vec3, horn_m: float, rod_m: float) -> None:
        self._anchor, self._servo, self._horn, self._rod = anchor_m, servo_m, horn_m, rod_m
        self._branch = 1.0
        one = self.servo_rad((0.0, 0.0))[0]
        self._branch = -1.0
        if abs(one) < abs(self.servo_rad((0.0, 0.0))[0]):
            self._branch = 1.0
        self._level = self.servo_rad((0.0, 0.0))
        self._inverse = _invert(self.rates((0.0, 0.0)))

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles."""
        return self._horn_rad(joints, 1.0), self._horn_rad(joints, -1.0)

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles, by Newton's method from the level head."""
        offset = servos[0] - self._level[0], servos[1] - self._level[1]
        joints = _multiply(self._inverse, offset)
        tip_a, tip_b = self._tip(servos[0], 1.0), self._tip(servos[1], -1.0)
        for _ in range(30):
            fa, a_first, a_second = self._rod_error(joints, 1.0, tip_a)
            fb, b_first, b_second = self._rod_error(joints, -1.0, tip_b)
            det = a_first * b_second - a_second * b_first
            if abs(det) < 1e-18:
                break
            first = (fa * b_second - fb * a_second) / det
            second = (fb * a_first - fa * b_first) / det
            joints = _clip(joints[0] - first), _clip(joints[1] - second)
            if abs(first) + abs(second) < 1e-13:
                break
        return joints

    def rates(self, joints: Pair) -> Rates:
        """Return the servo speeds per joint speed at joint angles."""
        a, b = self.servo_rad(joints)
        return self._slopes(joints, 1.0, a), self._slopes(joints, -1.0, b)

    def _slopes(self, joints: Pair, side: float, horn_rad: float) -> Pair:
        """Return the speed of one horn per joint speed."""
        tip = self._tip(horn_rad, side)
        _, first, second = self._rod_error(joints, side, tip)
        x, _, z = _pitch_and_roll(self._anchor, joints, side)
        across = (x - tip[0]) * self._horn * sin(horn_rad)
        turn = 2.0 * (across - (z - tip[2]) * abs(self._horn) * cos(horn_rad))
        return -first / turn, -second / turn

    def _horn_rad(self, joints: Pair, side: float) -> float:
        """Return the angle of one horn, on the branch of the level head."""
        at_x, at_y, at_z = _pitch_and_roll(self._anchor, joints, side)
        x, y, z = at_x - self._servo[0], at_y - side * self._servo[1], at_z - self._servo[2]
        gap2 = x * x + y * y + z * z
        along, up = self._horn * x, abs(self._horn) * z
        cosine = 0.5 * (gap2 + self._horn**2 - self._rod**2) / hypot(along, up)
        if abs(cosine) > 1.0:
            raise Unreachable("the rod is too " + ("short" if cosine > 0.0 else "long"))
        if abs(cosine) > _NEAR_LINE:
            raise Unreachable("the rod is in line with its horn there")
        turn = atan2(up, along) + self._branch * acos(cosine)
        return turn - 2.0 * pi * round(turn / (2.0 * pi))

    def _tip(self, horn_rad: float, side: float) -> Vec3:
        """Return the position of the end of a horn."""
        x, y, z = self._servo
        along, up = self._horn * cos(horn_rad), abs(self._horn) * sin(horn_rad)
        return x + along, side * y, z + up

    def _rod_error(self, joints: Pair, side: float, tip: Vec3) -> tuple[float, float, float]:
        """Return the error of a rod's squared length, and its derivatives by both joints."""
        first, second = joints
        cp, sp = cos(first), sin(first)
        cr, sr = cos(second), sin(second)
        ahead, aside, above = self._anchor
        aside *= side
        y, z = aside * cr - above * sr, aside * sr + above * cr
        at_x, at_z = ahead * cp - z * sp, ahead * sp + z * cp
        rod_x, rod_y, rod_z = at_x - tip[0], y - tip[1], at_z - tip[2]
        error = rod_x * rod_x + rod_y * rod_y + rod_z * rod_z - self._rod * self._rod
        by_first = 2.0 * (rod_z * at_x - rod_x * at_z)
        by_second = 2.0 * (rod_z * (y * cp) - rod_x * (y * sp) - rod_y * z)
        return error, by_first, by_second


class MeasuredGrid:
    """A table of servo angles on a grid of joint angles, with two plane triangles per cell.

    The outermost triangles extrapolate beyond the grid.

    Args:
        points: (first, second, a, b) of every point of the grid, in any order.

    Raises:
        ValueError: The points are not a grid, or a servo reverses; the message says where.
    """

    def __init__(self, points: Sequence[tuple[float, float, float, float]]) -> None:
        self._firsts = sorted({point[0] for point in points})
        self._seconds = sorted({point[1] for point in points})
        known = {(first, second): (a, b) for first, second, a, b in points}
        wanted = [(first, second) for first in self._firsts for second in self._seconds]
        if min(len(self._firsts), len(self._seconds)) < 2:
            raise ValueError("a measured coupling needs two angles or more of each joint")
        missing = [one for one in wanted if one not in known]
        if missing or len(known) != len(points):
            raise ValueError(
                "a measured coupling needs each angle of the first joint with each of the second, "
                "once" + (f"; missing: {_degrees(missing[0])}" if missing else "")
            )
        self._triangles = [
            _Triangle(corners, known)
            for low, high in pairwise(self._firsts)
            for left, right in pairwise(self._seconds)
            for corners in (
                ((low, left), (high, left), (high, right)),
                ((low, left), (high, right), (low, right)),
            )
        ]
        self._cells = _Cells(self._triangles)
        turns = [triangle.turn for triangle in self._triangles]
        for triangle in self._triangles:
            if triangle.turn * turns[0] <= 0.0:
                raise ValueError(
                    "the servos of a measured coupling reverse next to "
                    f"{_degrees(triangle.at)}: measure it again"
                )

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles."""
        return self._at(joints).servos(joints)

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles."""
        near = self._cells.near(servos)
        weights = [triangle.least_weight(servos) for triangle in near]
        if not weights or max(weights) < 0.0:  # outside the grid
            near, weights = self._triangles, [one.least_weight(servos) for one in self._triangles]
        return near[weights.index(max(weights))].joints(servos)

    def rates(self, joints: Pair) -> Rates:
        """Return the servo speeds per joint speed at joint angles."""
        return self._at(joints).slopes

    def contains(self, joints: Pair) -> bool:
        """Return whether joint angles are within the grid."""
        return (
            self._firsts[0] <= joints[0] <= self._firsts[-1]
            and self._seconds[0] <= joints[1] <= self._seconds[-1]
        )

    def _at(self, joints: Pair) -> "_Triangle":
        i = min(max(bisect_right(self._firsts, joints[0]) - 1, 0), len(self._firsts) - 2)
        j = min(max(bisect_right(self._seconds, joints[1]) - 1, 0), len(self._seconds) - 2)
        low, left = self._firsts[i], self._seconds[j]
        across = (joints[0] - low) / (self._firsts[i + 1] - low)
        along = (joints[1] - left) / (self._seconds[j + 1] - left)
        return self._triangles[2 * (i * (len(self._seconds) - 1) + j) + (along > across)]


class _Triangle:
    """A triangle of a measured grid.

    Attributes:
        at: First corner.
        slopes: Derivatives of servo angles by joint angles.
        turn: Determinant of the slopes.
        low, high: Bounds of its servo angles.
    """

    def __init__(self, corners: tuple[Pair, Pair, Pair], known: dict[Pair, Pair]) -> None:
        self.at, self._base = corners[0], known[corners[0]]
        (u1, v1), (u2, v2) = (_subtract(corner, self.at) for corner in corners[1:])
        (a1, b1), (a2, b2) = (_subtract(known[corner], self._base) for corner in corners[1:])
        area = u1 * v2 - u2 * v1
        self.slopes: Rates = (
            ((a1 * v2 - a2 * v1) / area, (u1 * a2 - u2 * a1) / area),
            ((b1 * v2 - b2 * v1) / area, (u1 * b2 - u2 * b1) / area),
        )
        (p, q), (r, s) = self.slopes
        self.turn = p * s - q * r
        self._back = _invert(self.slopes) if self.turn else None
        self._legs = (u1, v1), (u2, v2), area
        places = [known[corner] for corner in corners]
        self.low = min(a for a, _ in places), min(b for _, b in places)
        self.high = max(a for a, _ in places), max(b for _, b in places)

    def servos(self, joints: Pair) -> Pair:
        a, b = _multiply(self.slopes, _subtract(joints, self.at))
        return self._base[0] + a, self._base[1] + b

    def joints(self, servos: Pair) -> Pair:
        assert self._back is not None
        first, second = _multiply(self._back, _subtract(servos, self._base))
        return self.at[0] + first, self.at[1] + second

    def least_weight(self, servos: Pair) -> float:
        """Return the least of a point's three weights: negative outside."""
        (u1, v1), (u2, v2), area = self._legs
        assert self._back is not None
        (p, q), (r, s) = self._back
        a, b = servos[0] - self._base[0], servos[1] - self._base[1]
        u, v = p * a + q * b, r * a + s * b
        one, two = (u * v2 - u2 * v) / area, (u1 * v - u * v1) / area
        return min(one, two, 1.0 - one - two)


class _Cells:
    """An index of a grid's triangles by cells of servo angles."""

    def __init__(self, triangles: Sequence[_Triangle]) -> None:
        self._low = min(one.low[0] for one in triangles), min(one.low[1] for one in triangles)
        high = max(one.high[0] for one in triangles), max(one.high[1] for one in triangles)
        self._count = max(1, round(len(triangles) ** 0.5))
        self._size = [
            (h - low) / self._count or 1.0 for low, h in zip(self._low, high, strict=True)
        ]
        self._cells: dict[tuple[int, int], list[_Triangle]] = {}
        for one in triangles:
            (first, left), (last, right) = self._cell(one.low), self._cell(one.high)
            for i in range(first, last + 1):
                for j in range(left, right + 1):
                    self._cells.setdefault((i, j), []).append(one)

    def near(self, servos: Pair) -> Sequence[_Triangle]:
        """Return all triangles that may contain a point, none beyond the grid."""
        if not (isfinite(servos[0]) and isfinite(servos[1])):
            return ()
        return self._cells.get(self._cell(servos), ())

    def _cell(self, servos: Pair) -> tuple[int, int]:
        return (
            floor((servos[0] - self._low[0]) / self._size[0]),
            floor((servos[1] - self._low[1]) / self._size[1]),
        )


def _subtract(one: Pair, other: Pair) -> Pair:
    return one[0] - other[0], one[1] - other[1]


def _multiply(rates: Rates, by: Pair) -> Pair:
    (p, q), (r, s) = rates
    return p * by[0] + q * by[1], r * by[0] + s * by[1]


def _invert(rates: Rates) -> Rates:
    (p, q), (r, s) = rates
    det = p * s - q * r
    return (s / det, -q / det), (-r / det, p / det)


def joint_rates(rates: Rates, servo_rates: Pair) -> Pair:
    """Return the joint speeds of servo speeds, 0 if the mechanism jams."""
    (p, q), (r, s) = rates
    return _multiply(_invert(rates), servo_rates) if p * s - q * r else (0.0, 0.0)


def _clip(angle: float) -> float:
    return min(max(angle, -0.5 * pi), 0.5 * pi) if isfinite(angle) else 0.0


def _pitch_and_roll(p: Vec3, joints: Pair, side: float) -> Vec3:
    """Return a point, mirrored for the right side, pitched and rolled.

    The rotation is that of ``gazerig.gaze.angles.rotation`` without yaw.
    """
    first, second = joints
    cp, sp, cr, sr = cos(first), sin(first), cos(second), sin(second)
    y, z = side * p[1] * cr - p[2] * sr, side * p[1] * sr + p[2] * cr
    return p[0] * cp - z * sp, y, p[0] * sp + z * cp


def _degrees(pair: Pair) -> str:
    return f"{pair[0] * 180.0 / pi:g}, {pair[1] * 180.0 / pi:g} deg"
