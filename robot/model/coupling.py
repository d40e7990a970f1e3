"""Two servos that move two joints together: a differential, two push rods, a measured table. Pure.

Joints are called first and second, in radians; servos a and b, as angles of their shafts (or of
whatever their sign, ratio and zero are given for). A neck's pitch and roll are the usual pair.
"""

from bisect import bisect_right
from collections.abc import Sequence
from math import acos, atan2, cos, hypot, isfinite, pi, sin
from typing import Protocol

from gazerig.gaze.types import Vec3

Pair = tuple[float, float]
Rates = tuple[Pair, Pair]
"""How much a, and how much b turns per radian of the first and of the second joint."""


class Unreachable(ValueError):
    """No angle of the servos makes these angles of the joints; the message says why."""


class Coupling(Protocol):
    """What lies between two servos and two joints."""

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles.

        Raises:
            Unreachable: there are none.
        """
        ...

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles; of impossible ones, some finite angles."""
        ...

    def rates(self, joints: Pair) -> Rates:
        """Return how fast the servos turn for each joint's speed, at joint angles.

        Raises:
            Unreachable: there are no such servo angles.
        """
        ...


class Differential:
    """Bevel gears: the servos' sum turns the first joint, their difference the second.

    Args:
        first_ratio: turns of the servos for one turn of the first joint.
        second_ratio: turns of the servos, against each other, for one of the second.
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
        """Return how fast the servos turn for each joint's speed: the same everywhere."""
        return (self._first, self._second), (self._first, -self._second)


_NEAR_LINE = 0.98
"""A rod nearer to the line through its horn (sine of the angle) has no force and two solutions."""


class PushRods:
    """Two servos with horns and rods of fixed length, left and right of a head on a joint.

    Frame of the neck's pitch axis: x ahead, y left, z up; the first joint is pitch, the second
    roll. The horns turn about axes parallel to y; at 0 they are level.

    Args:
        anchor_m: where the left rod holds the head, with the head level; the right one mirrored.
        servo_m: the axis of the left servo's horn; the right one mirrored.
        horn_m: length of the horns; negative where they point back.
        rod_m: length of the rods.

    Raises:
        Unreachable: the rods do not fit with the head level.
    """

    def __init__(self, anchor_m: Vec3, servo_m: Vec3, horn_m: float, rod_m: float) -> None:
        self._anchor, self._servo, self._horn, self._rod = anchor_m, servo_m, horn_m, rod_m
        self._branch = 1.0
        one = self.servo_rad((0.0, 0.0))[0]
        self._branch = -1.0
        if abs(one) < abs(self.servo_rad((0.0, 0.0))[0]):
            self._branch = 1.0
        self._level = self.servo_rad((0.0, 0.0))
        self._inverse = _inverted(self.rates((0.0, 0.0)))

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles."""
        return self._horn_rad(joints, 1.0), self._horn_rad(joints, -1.0)

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles, by Newton's method from the level head."""
        offset = servos[0] - self._level[0], servos[1] - self._level[1]
        joints = _times(self._inverse, offset)
        for _ in range(30):
            (fa, da, _), (fb, db, _) = (self._rod_error(joints, s, t) for s, t in _sides(servos))
            det = da[0] * db[1] - da[1] * db[0]
            if abs(det) < 1e-18:
                break
            step = (fa * db[1] - fb * da[1]) / det, (fb * da[0] - fa * db[0]) / det
            joints = _clipped(joints[0] - step[0]), _clipped(joints[1] - step[1])
            if abs(step[0]) + abs(step[1]) < 1e-13:
                break
        return joints

    def rates(self, joints: Pair) -> Rates:
        """Return how fast the servos turn for each joint's speed, at joint angles."""
        found = []
        for side, horn in _sides(self.servo_rad(joints)):
            _, (first, second), turn = self._rod_error(joints, side, horn)
            found.append((-first / turn, -second / turn))
        return found[0], found[1]

    def _horn_rad(self, joints: Pair, side: float) -> float:
        """Return the angle of one horn, on the branch that the level head is on."""
        (x, _, z), gap2 = self._gap(joints, side)
        along, up = self._horn * x, abs(self._horn) * z
        cosine = 0.5 * (gap2 + self._horn**2 - self._rod**2) / hypot(along, up)
        if abs(cosine) > 1.0:
            raise Unreachable("the rod is too " + ("short" if cosine > 0.0 else "long"))
        if abs(cosine) > _NEAR_LINE:
            raise Unreachable("the rod is in line with its horn there")
        turn = atan2(up, along) + self._branch * acos(cosine)
        return turn - 2.0 * pi * round(turn / (2.0 * pi))

    def _gap(self, joints: Pair, side: float) -> tuple[Vec3, float]:
        """Return the way from the horn's axis to the rod's anchor, and its square."""
        anchor = _tilted(self._anchor, joints, side)[0]
        x, y, z = self._servo
        gap = anchor[0] - x, anchor[1] - side * y, anchor[2] - z
        return gap, gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2

    def _rod_error(self, joints: Pair, side: float, horn_rad: float) -> tuple[float, Pair, float]:
        """Return by how much a rod's squared length is off, and its slopes by joints and horn."""
        anchor, by_first, by_second = _tilted(self._anchor, joints, side)
        x, y, z = self._servo
        h, up = self._horn, abs(self._horn)
        tip = x + h * cos(horn_rad), side * y, z + up * sin(horn_rad)
        rod = anchor[0] - tip[0], anchor[1] - tip[1], anchor[2] - tip[2]
        error = rod[0] ** 2 + rod[1] ** 2 + rod[2] ** 2 - self._rod**2
        first = 2.0 * sum(r * d for r, d in zip(rod, by_first, strict=True))
        second = 2.0 * sum(r * d for r, d in zip(rod, by_second, strict=True))
        turn = 2.0 * (rod[0] * h * sin(horn_rad) - rod[2] * up * cos(horn_rad))
        return error, (first, second), turn


class MeasuredGrid:
    """Servo angles measured at a grid of joint angles, plane between them: two triangles a field.

    Beyond the grid the outermost triangles go on.

    Args:
        points: (first, second, a, b) of every point of the grid, in any order.

    Raises:
        ValueError: they are no grid, or the servos turn back somewhere; the message says where.
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
                "once" + (f"; missing is {_degrees(missing[0])}" if missing else "")
            )
        self._triangles = [
            _Triangle(corners, known)
            for i in range(len(self._firsts) - 1)
            for j in range(len(self._seconds) - 1)
            for corners in self._corners(i, j)
        ]
        turns = [triangle.turn for triangle in self._triangles]
        for triangle in self._triangles:
            if triangle.turn * turns[0] <= 0.0:
                raise ValueError(
                    "the servos of a measured coupling turn back beside "
                    f"{_degrees(triangle.at)}: measure it anew"
                )

    def _corners(self, i: int, j: int) -> tuple[tuple[Pair, Pair, Pair], ...]:
        low, high = self._firsts[i], self._firsts[i + 1]
        left, right = self._seconds[j], self._seconds[j + 1]
        return (
            ((low, left), (high, left), (high, right)),
            ((low, left), (high, right), (low, right)),
        )

    def servo_rad(self, joints: Pair) -> Pair:
        """Return the servo angles of joint angles."""
        return self._at(joints).servos(joints)

    def joint_rad(self, servos: Pair) -> Pair:
        """Return the joint angles of servo angles."""
        best = max(self._triangles, key=lambda triangle: triangle.inside(servos))
        return best.joints(servos)

    def rates(self, joints: Pair) -> Rates:
        """Return how fast the servos turn for each joint's speed, at joint angles."""
        return self._at(joints).slopes

    def holds(self, joints: Pair) -> bool:
        """True if joint angles lie within the grid."""
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
    """One plane piece of a measured grid.

    at: its first corner; slopes: servo angles by joint angles; turn: their determinant
    """

    def __init__(self, corners: tuple[Pair, Pair, Pair], known: dict[Pair, Pair]) -> None:
        self.at, self._base = corners[0], known[corners[0]]
        (u1, v1), (u2, v2) = (_less(corner, self.at) for corner in corners[1:])
        (a1, b1), (a2, b2) = (_less(known[corner], self._base) for corner in corners[1:])
        area = u1 * v2 - u2 * v1
        self.slopes: Rates = (
            ((a1 * v2 - a2 * v1) / area, (u1 * a2 - u2 * a1) / area),
            ((b1 * v2 - b2 * v1) / area, (u1 * b2 - u2 * b1) / area),
        )
        (p, q), (r, s) = self.slopes
        self.turn = p * s - q * r
        self._back = _inverted(self.slopes) if self.turn else None
        self._legs = (u1, v1), (u2, v2), area

    def servos(self, joints: Pair) -> Pair:
        a, b = _times(self.slopes, _less(joints, self.at))
        return self._base[0] + a, self._base[1] + b

    def joints(self, servos: Pair) -> Pair:
        assert self._back is not None
        first, second = _times(self._back, _less(servos, self._base))
        return self.at[0] + first, self.at[1] + second

    def inside(self, servos: Pair) -> float:
        """Return the least of a point's three weights: negative outside."""
        (u1, v1), (u2, v2), area = self._legs
        u, v = _less(self.joints(servos), self.at)
        one, two = (u * v2 - u2 * v) / area, (u1 * v - u * v1) / area
        return min(one, two, 1.0 - one - two)


def _less(one: Pair, other: Pair) -> Pair:
    return one[0] - other[0], one[1] - other[1]


def _times(rates: Rates, by: Pair) -> Pair:
    (p, q), (r, s) = rates
    return p * by[0] + q * by[1], r * by[0] + s * by[1]


def _inverted(rates: Rates) -> Rates:
    (p, q), (r, s) = rates
    det = p * s - q * r
    return (s / det, -q / det), (-r / det, p / det)


def joint_rates(rates: Rates, servo_rates: Pair) -> Pair:
    """Return the joints' speeds of servo speeds, 0 where the mechanism jams."""
    (p, q), (r, s) = rates
    return _times(_inverted(rates), servo_rates) if p * s - q * r else (0.0, 0.0)


def _sides(servos: Pair) -> tuple[Pair, Pair]:
    return (1.0, servos[0]), (-1.0, servos[1])


def _clipped(angle: float) -> float:
    return min(max(angle, -0.5 * pi), 0.5 * pi) if isfinite(angle) else 0.0


def _tilted(p: Vec3, joints: Pair, side: float) -> tuple[Vec3, Vec3, Vec3]:
    """Return a point, mirrored for the right side, pitched and rolled, and its slopes by both.

    The rotation is that of ``gazerig.gaze.angles.rotation`` without yaw.
    """
    x, (cp, sp), (cr, sr) = p[0], *((cos(angle), sin(angle)) for angle in joints)
    y, z = side * p[1] * cr - p[2] * sr, side * p[1] * sr + p[2] * cr
    point = x * cp - z * sp, y, x * sp + z * cp
    return point, (-point[2], 0.0, point[0]), (-y * sp, -z, y * cp)


def _degrees(pair: Pair) -> str:
    return f"{pair[0] * 180.0 / pi:g}, {pair[1] * 180.0 / pi:g} deg"
