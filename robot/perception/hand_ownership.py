"""Association of moving image patches with people: a face and its body are one target.

A person who walks is detected twice, as a face and as a patch of optical flow. The patch would
compete with the face, and would often win because it is larger. A patch therefore belongs to the
person if it is on the head, or if it is below the head and moves with it. A waving arm moves
differently and remains a separate body (gazerig.robot.perception.hands), so that a wave attracts
the gaze.

The positions of the robot's own head and neck in the camera's view are known from the kinematics,
and both are ignored: a camera on the base sees the head turn, and one on the head may see parts of
it. A patch in the direction of a part of the head is that part, unless its measured distance
differs.
"""

from collections.abc import Callable, Iterable, Sequence
from math import hypot

from gazerig.drivers.types import Located
from gazerig.gaze.angles import add, norm, perpendicular, scale, sub, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.kinematics import Capsule
from gazerig.robot.perception.hands import Known
from gazerig.robot.perception.track import UNNAMED

_HEAD_M, _HALF_WIDTH_M, _BELOW_M, _ABOVE_M = 0.25, 0.35, 1.7, 0.25
# Tolerance in depth, in addition to two standard deviations.
_DEEP_M = 0.5
_ALONG_WITH_M_S, _ALONG_WITH_SHARE = 0.3, 0.5


def without_own_motion(
    faces: list[Located],
    things: Iterable[Located],
    before: Iterable[Known],
    p_camera: Vec3,
) -> tuple[list[Located], list[Located]]:
    """Return the faces with the spin of their own motion, and the things that belong to no face.

    before: tracked faces at their positions predicted for now
    """
    spins = [0.0] * len(faces)
    known = known_faces(faces, before)
    others: list[Located] = []
    for thing in things:
        owner = _owner(thing, known, p_camera)
        if owner is None:
            others.append(thing)
        elif owner < len(faces):
            off = _offset_from_face(thing, known[owner][0], p_camera)
            if off is not None and hypot(*off) < _HEAD_M:
                spins[owner] = max(spins[owner], thing.spin_rad_s, key=abs)
    turned = [
        face._replace(spin_rad_s=spin) if spin != 0.0 else face
        for face, spin in zip(faces, spins, strict=True)
    ]
    return turned, others


def known_faces(faces: list[Located], before: Iterable[Known]) -> list[Known]:
    """Return the faces of a frame with the velocities of their tracks, and those tracks.

    A face that the detector has just missed still owns its body's motion.
    """
    tracked, found = list(before), []
    for face in faces:
        near = [(norm(sub(p, face.p_m)), v) for p, v in tracked]
        away, v = min(near, key=lambda pair: pair[0], default=(1.0, None))
        found.append((face.p_m, v if away < _HEAD_M else None))
    return [*found, *tracked]


def _owner(thing: Located, faces: list[Known], p_camera: Vec3) -> int | None:
    """Return the index of the face to which a patch belongs, None without one."""
    if thing.kind != UNNAMED:
        return None
    for k, (p_face, v_face) in enumerate(faces):
        if (off := _offset_from_face(thing, p_face, p_camera)) is None:
            continue
        if hypot(*off) < _HEAD_M:
            return k
        on_body = off[0] < _HALF_WIDTH_M and -_BELOW_M < off[1] < _ABOVE_M
        if on_body and _moves_along(thing, p_face, v_face, p_camera):
            return k
    return None


def _offset_from_face(thing: Located, p_face: Vec3, p_camera: Vec3) -> tuple[float, float] | None:
    """Return the sideways and upward offset of a patch from a face; None if its depth differs.

    A patch whose distance is only assumed is placed at the face's distance.
    """
    far = norm(sub(p_face, p_camera))
    way = sub(thing.p_m, p_camera)
    if thing.depth_measured and abs(norm(way) - far) > _DEEP_M + 2.0 * thing.along_sd_m:
        return None
    place = add(p_camera, scale(unit(way), far))
    x, y, z = sub(place, p_face)
    return hypot(x, y), z


def _moves_along(thing: Located, p_face: Vec3, v_face: Vec3 | None, p_camera: Vec3) -> bool:
    """Return whether a patch moves across the view as the face does; also if unknown."""
    if thing.v_m_s is None or v_face is None:
        return True
    way = sub(thing.p_m, p_camera)
    v = thing.v_m_s
    if not thing.depth_measured:
        v = scale(v, norm(sub(p_face, p_camera)) / max(norm(way), 1e-6))
    across = norm(perpendicular(sub(v, v_face), unit(way)))
    return across < max(_ALONG_WITH_M_S, _ALONG_WITH_SHARE * norm(v_face))


OWN = "own"

OwnParts = Callable[[Mat3, Vec3], Sequence[Capsule]]
"""Returns the parts of the head in the world for a pose."""

_MARGIN_M = 0.05


def label_own_body(
    things: list[Located], parts: Sequence[Capsule], p_camera: Vec3
) -> list[Located]:
    """Return the things, with the kind OWN for parts of the robot's own body.

    Args:
        things: moving things of a frame.
        parts: parts of the head at the exposure. A part around the camera is not visible.
        p_camera: position of the camera.
    """
    seen = [part for part in parts if not part.contains(p_camera)]
    if not seen:
        return things
    return [
        thing._replace(kind=OWN)
        if thing.kind == UNNAMED and any(_is_part(thing, part, p_camera) for part in seen)
        else thing
        for thing in things
    ]


def _is_part(thing: Located, part: Capsule, p_camera: Vec3) -> bool:
    """Return whether a thing is a part of the head."""
    way = sub(thing.p_m, p_camera)
    hit_m = part.hit_m(p_camera, unit(way))
    if hit_m is None:
        return False
    if not thing.depth_measured:
        return True
    margin_m = _MARGIN_M + 2.0 * thing.along_sd_m
    return hit_m - margin_m < norm(way) < hit_m + 2.0 * part.radius_m + margin_m
