"""Collisions between parts of a rig's model within the limits of its joints. Pure.

Bodies are compared by their collision shapes, lids by the elevations of their edges. The shoulders
are those of the model, so a finding is a hint and not a fault of the rig.
"""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import combinations
from math import degrees
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.description.build import RigShape, describe
from gazerig.robot.description.links import ORIGIN, CollisionShape, Description, Pose
from gazerig.robot.description.solid import ellipsoid

_STEPS, _HALVINGS = 7, 7
"""Number of tested angles of a joint, including its limits; number of bisections."""
_DEEP_M = 0.003
"""Permitted overlap of parts: skin and foam are soft."""
_LIDS_OVERLAP_DEG = 8.0
"""Permitted overlap of lid edges: they are soft, or slide over each other."""
_POINTS = 160


class Collision(NamedTuple):
    """Two parts that collide within the limits of the joints, and the remedy."""

    angles_deg: Mapping[str, float]
    parts: tuple[str, str]
    cure: str

    def text(self) -> str:
        """Return the collision as one line."""
        pose = ", ".join(f"{joint} {angle:.0f} deg" for joint, angle in self.angles_deg.items())
        return f"{pose}: {self.parts[0]} runs into {self.parts[1]}; {self.cure}"


def collisions(rig: RigShape) -> tuple[Collision, ...]:
    """Return the collisions of a rig: for each pair of parts the pose nearest to straight ahead.

    Each joint is tested alone, and each pair of neck joints together.
    """
    return (*_lid_collisions(rig), *_body_collisions(describe(rig, looks=False)))


def _lid_collisions(rig: RigShape) -> Iterator[Collision]:
    for side in ("left", "right"):
        names = [f"{side}_{which}_lid" for which in ("upper", "lower")]
        if not all(name in rig.lids and name in rig.joints for name in names):
            continue
        # Travel of each lid beyond its shut angle, in degrees.
        ends, beyond = {}, {}
        for name in names:
            shut, wide = rig.lids[name]
            limit = rig.joints[name].limit()
            end = limit.low_rad if wide > shut else limit.high_rad
            ends[name] = degrees(end)
            beyond[name] = max(0.0, degrees(shut - end if wide > shut else end - shut))
        if sum(beyond.values()) > _LIDS_OVERLAP_DEG:
            worst = max(beyond, key=lambda name: beyond[name])
            key = "min_deg" if rig.lids[worst][1] > rig.lids[worst][0] else "max_deg"
            shut_deg = degrees(rig.lids[worst][0])
            cure = f"set joints.{worst}.{key} nearer to {shut_deg:.0f}, where the lid is shut"
            yield Collision(ends, (names[0], names[1]), cure)


def _body_collisions(description: Description) -> Iterator[Collision]:
    pairs = _movable_pairs(description)
    found: set[tuple[str, str]] = set()
    for angles in _test_poses(description):
        left = [pair for pair in pairs if pair not in found]
        if not left:
            return
        poses = _placed_links(description, angles)
        for one, other in left:
            if _depth_m(description, poses, one, other) <= _DEEP_M:
                continue
            found.add((one, other))
            first = _first_collision(description, angles, one, other)
            named = {joint: degrees(angle) for joint, angle in first.items()}
            joint, angle = max(named.items(), key=lambda item: abs(item[1]))
            key = "min_deg" if angle < 0.0 else "max_deg"
            cure = f"set joints.{joint}.{key} to {int(angle)} where the real one has no more room"
            if len(named) > 1:
                cure = (
                    f"forbid {' and '.join(named)} together (guard.collisions) where the real "
                    "ones have no more room"
                )
            yield Collision(named, (one, other), cure)


def _placed_links(description: Description, angles: Mapping[str, float]) -> dict[str, Pose]:
    return description.poses(description.angles(tuple(angles), tuple(angles.values())))


def _first_collision(
    description: Description, angles: Mapping[str, float], one: str, other: str
) -> dict[str, float]:
    """Return the first pose on the path to another at which the bodies of two links touch."""
    free, met = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (free + met)
        poses = _placed_links(description, {name: middle * a for name, a in angles.items()})
        deep = _depth_m(description, poses, one, other) > _DEEP_M
        free, met = (free, middle) if deep else (middle, met)
    return {name: met * angle for name, angle in angles.items()}


def _movable_pairs(description: Description) -> list[tuple[str, str]]:
    """Return pairs of links that could collide because a joint moves one relative to the other."""
    touching = {frozenset(pair) for pair in description.may_touch}
    solid = [link.name for link in description.links if _link_shapes(description, link.name)]
    return [
        (other, one)
        for one, other in combinations(solid, 2)
        if frozenset((one, other)) not in touching and description.link(other).parent != one
    ]


def _link_shapes(description: Description, name: str) -> tuple[CollisionShape, ...]:
    return tuple(shape for shape in description.link(name).collisions if shape.layer == "body")


def _test_poses(description: Description) -> Iterator[dict[str, float]]:
    """Yield angles of one joint, then of two joints of the necks, small ones first."""
    limits = {
        joint.name: (joint.low_rad, joint.high_rad)
        for joint in description.joints
        if joint.follows is None
    }
    solid = {link.name for link in description.links if _link_shapes(description, link.name)}
    moving = [name for name in limits if "neck" in name or f"{name}_link" in solid]
    for share in np.linspace(0.0, 1.0, _STEPS)[1:].tolist():
        for name in moving:
            for end in limits[name]:
                yield {name: share * end}
    for share in np.linspace(0.0, 1.0, _STEPS)[1:].tolist():
        for one, other in combinations([name for name in moving if "neck" in name], 2):
            for a in limits[one]:
                for b in limits[other]:
                    yield {one: share * a, other: share * b}


def _depth_m(description: Description, poses: Mapping[str, Pose], one: str, other: str) -> float:
    """Return the penetration depth of two links' bodies, negative if they are apart."""
    deepest = -np.inf
    for a in _link_shapes(description, one):
        for b in _link_shapes(description, other):
            for inner, outer, first, second in ((a, b, one, other), (b, a, other, one)):
                points = _place_points(
                    _surface_points(inner.kind, inner.half_m), inner, poses[first]
                )
                deepest = max(deepest, -float(_distances(outer, poses[second], points).min()))
    return deepest


def _place_points(points: Floats, shape: CollisionShape, pose: Pose) -> Floats:
    in_link = points @ np.array(shape.R).T + shape.p_m
    return np.asarray(in_link @ np.array(pose[0]).T + pose[1])


@lru_cache(maxsize=64)
def _surface_points(kind: str, half_m: tuple[float, float, float]) -> Floats:
    """Return points distributed over the surface of a shape."""
    at = np.arange(_POINTS) + 0.5
    up, around = 1.0 - 2.0 * at / _POINTS, at * np.pi * (1.0 + np.sqrt(5.0))
    level = np.sqrt(1.0 - up * up)
    ball = np.stack((level * np.cos(around), level * np.sin(around), up), axis=1)
    if kind == "capsule":
        radius, half, _ = half_m
        points = radius * ball
        points[:, 2] += half * np.sign(ball[:, 2])
        return points
    if kind == "box":
        return np.asarray(ball / np.abs(ball).max(axis=1, keepdims=True) * half_m)
    return np.asarray(ball * (half_m if kind == "ellipsoid" else half_m[0]))


def _distances(shape: CollisionShape, pose: Pose, points: Floats) -> Floats:
    """Return the distances of points (n, 3) of the world outside a shape."""
    in_link = (points - pose[1]) @ np.array(pose[0])
    local = (in_link - shape.p_m) @ np.array(shape.R)
    if shape.kind == "box":
        off = np.abs(local) - shape.half_m
        outside = np.linalg.norm(np.maximum(off, 0.0), axis=1)
        return np.asarray(outside + np.minimum(off.max(axis=1), 0.0))
    if shape.kind == "ellipsoid":
        return ellipsoid(ORIGIN, shape.half_m)(local)
    radius, half, _ = shape.half_m
    if shape.kind == "capsule":
        local[:, 2] -= np.clip(local[:, 2], -half, half)
    return np.asarray(np.linalg.norm(local, axis=1) - radius)
