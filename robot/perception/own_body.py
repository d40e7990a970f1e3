"""The robot's own head and neck in its camera's view: known by the kinematics, and ignored.

A camera on the base sees the head turn, and a camera on the head may see parts of it; both appear
as independently moving patches. A patch in the direction of a part of the head is that part, unless
its distance was measured and differs.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from gazerig.gaze.angles import norm, sub, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.capsule import Capsule
from gazerig.robot.perception.track import UNNAMED, LocalisedDetection

OWN = "own"

OwnParts = Callable[[Mat3, Vec3], Sequence[Capsule]]
"""Function that returns the parts of the head in the world for its pose."""

_MARGIN_M = 0.05


def label_own_body(
    things: list[LocalisedDetection], parts: Sequence[Capsule], p_camera: Vec3
) -> list[LocalisedDetection]:
    """Return the things, with the kind OWN for those that are the robot's own body.

    Args:
        things: moving things of a frame.
        parts: of the head, at its exposure. A part around the camera is not visible.
        p_camera: position of the camera.
    """
    seen = [part for part in parts if not part.holds(p_camera)]
    if not seen:
        return things
    return [
        replace(thing, kind=OWN)
        if thing.kind == UNNAMED and any(_is_part(thing, part, p_camera) for part in seen)
        else thing
        for thing in things
    ]


def _is_part(thing: LocalisedDetection, part: Capsule, p_camera: Vec3) -> bool:
    """Return whether a thing is a part of the head."""
    way = sub(thing.p_world_m, p_camera)
    hit_m = part.hit_m(p_camera, unit(way))
    if hit_m is None:
        return False
    if not thing.depth_measured:
        return True
    margin_m = _MARGIN_M + 2.0 * thing.along_sd_m
    return hit_m - margin_m < norm(way) < hit_m + 2.0 * part.radius_m + margin_m
