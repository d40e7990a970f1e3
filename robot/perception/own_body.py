"""The robot's own head and neck in its camera's view: known by the kinematics, not looked at.

A camera on the base sees the head turn, a camera on the head may see parts of it; both are patches
that move by themselves. What is seen in a direction in which a part of the head is in the way is
that part, unless its distance was measured and is another.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from gazerig.gaze.angles import norm, sub, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.capsule import Capsule
from gazerig.robot.perception.track import UNNAMED, LocalisedDetection

OWN = "own"

OwnParts = Callable[[Mat3, Vec3], Sequence[Capsule]]
"""Gives the parts of the head in the world for its pose."""

_MARGIN_M = 0.05


def own_named(
    things: list[LocalisedDetection], parts: Sequence[Capsule], p_camera: Vec3
) -> list[LocalisedDetection]:
    """Return the things, those that are the robot's own body by this name.

    Args:
        things: what moves in a frame.
        parts: of the head, where they were at its exposure. One that the camera is inside of is
            not seen.
        p_camera: from where it was seen.
    """
    seen = [part for part in parts if not part.holds(p_camera)]
    if not seen:
        return things
    return [
        replace(thing, kind=OWN)
        if thing.kind == UNNAMED and any(_is(thing, part, p_camera) for part in seen)
        else thing
        for thing in things
    ]


def _is(thing: LocalisedDetection, part: Capsule, p_camera: Vec3) -> bool:
    """Return whether a part of the head is what is seen."""
    way = sub(thing.p_world_m, p_camera)
    hit_m = part.hit_m(p_camera, unit(way))
    if hit_m is None:
        return False
    if not thing.depth_measured:
        return True
    margin_m = _MARGIN_M + 2.0 * thing.along_sd_m
    return hit_m - margin_m < norm(way) < hit_m + 2.0 * part.radius_m + margin_m
