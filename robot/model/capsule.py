"""Capsule: the volume of a part of the head, for tests of points and rays."""

from math import sqrt
from typing import NamedTuple

from gazerig.gaze.angles import add, dot, norm, scale, sub
from gazerig.gaze.types import Vec3


class Capsule(NamedTuple):
    """All points within ``radius_m`` of the line from ``start_m`` to ``end_m``, in one frame."""

    start_m: Vec3
    end_m: Vec3
    radius_m: float

    def holds(self, p_m: Vec3) -> bool:
        """Return whether a point is inside."""
        axis = sub(self.end_m, self.start_m)
        along = dot(sub(p_m, self.start_m), axis) / max(dot(axis, axis), 1e-12)
        nearest = add(self.start_m, scale(axis, min(1.0, max(0.0, along))))
        return norm(sub(p_m, nearest)) < self.radius_m

    def hit_m(self, p_m: Vec3, direction: Vec3) -> float | None:
        """Return the distance from an outside point along a unit vector, None without a hit.

        The distance is that to the sphere about the point of the line nearest to the ray.
        """
        axis, off = sub(self.end_m, self.start_m), sub(self.start_m, p_m)
        aa, ad = dot(axis, axis), dot(axis, direction)
        denominator = aa - ad * ad
        share = 0.0
        if denominator > 1e-12:
            share = (ad * dot(off, direction) - dot(off, axis)) / denominator
        middle = add(off, scale(axis, min(1.0, max(0.0, share))))
        along = dot(middle, direction)
        off2 = dot(middle, middle) - along * along
        if along <= 0.0 or off2 >= self.radius_m**2:
            return None
        return along - sqrt(self.radius_m**2 - off2)
