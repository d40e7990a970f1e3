"""Whose motion is whose: hands, the bodies of people, and the robot's own head.

A hand is a patch that moves relative to a person, within reach, and with evidence.

A camera without a hand detector shows a moving arm as one patch of flow. The quarter of it that
moves fastest is taken as the hand, at the distance of the person's face unless the distance was
measured. Any of these is evidence of a hand: the patch points to the person's shoulder and is
fastest at the other end, it reaches in from the side in front of all people, it approaches the
camera, or the palm detector found a palm there. Where palms are searched, the shape of a patch is
no evidence: coats, hair and sleeves of a crowd have that of an arm. Curtains, trunks and other
people's sleeves remain moving things. If many patches approach, they are people who walk.

A patch remains a hand while the detector keeps its number and it moves occasionally. So a track
does not break when a hand turns or passes in front of the face. The remainder of an arm that was a
hand is also a hand. A hand at rest is kept for a while, although optical flow does not show still
things. A palm is kept from one search to the next, whether it moves or not.

A hand that approaches the camera, or reaches in from the side near it, is nearer than its person.
Without measured depth the size gives the distance. A compact patch that is not an arm and is too
large for a hand at the person's distance is placed where it has the size of a hand. An arm that
enters at the side of the image, and not from the person's shoulder, is placed where it is as wide
as a hand.

A person who walks is detected twice, as a face and as a patch of optical flow. The patch would
compete with the face, and would often win because it is larger. A patch that is no hand therefore
belongs to the person if it is on the head, or if it is below the head and moves with it.

The positions of the robot's own head and neck in the camera's view are known from the kinematics,
and both are ignored: a camera on the base sees the head turn, and one on the head may see parts of
it. A patch in the direction of a part of the head is that part, unless its measured distance
differs.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import hypot, inf
from typing import NamedTuple

from gazerig.drivers.types import Located
from gazerig.gaze.angles import add, dot, norm, perpendicular, scale, sub, unit
from gazerig.gaze.types import Vec3
from gazerig.robot.perception.track import UNNAMED

HAND = "hand"
_STILL: Vec3 = (0.0, 0.0, 0.0)
Known = tuple[Vec3, Vec3 | None]
"""Position of a face in the world, and its velocity, None if unknown."""

# Range of hands around the face: sideways, above, and below; legs and feet are lower.
_REACH_M, _ABOVE_M, _BELOW_M = 0.85, 0.7, 0.8
# Largest arm or hand (radius of a disc of the same area).
_LARGEST_M = 0.24
# Speed across the view relative to the person that is needed to become a hand, to remain one, and
# to become one in front of the head, which itself moves when it turns or nods.
_BEGINS_M_S, _STAYS_M_S, _BEFORE_HEAD_M_S = 0.4, 0.2, 1.5
_HEAD_M = 0.25
_SHOULDER_ASIDE_M, _SHOULDER_BELOW_M = 0.19, 0.17
_SAME_M = 0.3
"""Largest motion of a face from frame to frame."""
# The line of an arm passes the shoulder within this distance, and an arm is no smaller than this
# (as _LARGEST_M). For rendered people who wave, point and box 98 % of the arms pass within .26 m.
_ATTACHED_M, _SMALLEST_M = 0.27, 0.04
# Its end is at least as fast as the whole patch, within rounding.
_AS_FAST = 0.95
# Distance of a patch's end or, plus its radius, of its centre to its palm; time for which a palm
# follows the patch's flow between two searches; confidence of a certain palm.
_AT_PALM_M, _PALM_S, _SURE = 0.1, 0.3, 0.7
# Where palms are searched, a moving patch remains a hand for this time after its last evidence: the
# searches miss palms that are blurred or turned aside.
_MISSED_S = 0.7
# A patch of a hand's size that certainly grows in the image at this rate approaches the camera. It
# is a hand from the first frame on, because no other visible part of a person approaches so fast.
_COMES_1_S, _SURE_SD = 2.5, 2.0
# A person has two hands; more patches that approach in one frame are people who walk.
_MOST_COMING = 2
# Number of frames with such a motion that make a hand, and the longest rest between them.
_FRAMES, _RESTS_S = 2, 0.4
# A hand that was last slower than this is at rest, and is kept for this time; a motion within this
# distance of it is attributed to the hand.
_AT_REST_M_S, _HELD_S, _AGAIN_M = 0.4, 2.0, 0.3
_HAND_RADIUS_M = 0.07
# Size of a hand or fist in the flow if nothing else moves; the multiple of that size at the
# person's distance, and the number of frames, above which it is nearer: hands of other people are
# not so large.
_ALONE_M, _TOO_LARGE, _LARGE_FRAMES = 0.065, 1.6, 2
# Width of a hand; least width of an arm that enters at the side, in such widths; number of frames
# in which it is measured; and least distance of its line from the person's shoulder.
_WIDE_M, _TOO_WIDE, _WIDE_FRAMES, _ANOTHERS_M = 0.085, 1.4, 3, 0.165
# Gain per frame with which a change of this distance is adopted.
_NEARER_GAIN = 0.5
_ACROSS_SD_M, _ALONG_SD_M = 0.04, 0.25
# Half width of a body around the head, and its extent below and above it.
_BODY_HALF_M, _BODY_BELOW_M, _BODY_ABOVE_M = 0.35, 1.7, 0.25
# Tolerance of a body's depth, in addition to two standard deviations.
_DEEP_M = 0.5
# Speed across the view relative to a person below which a patch moves along: at least this, or this
# fraction of the person's.
_ALONG_WITH_M_S, _ALONG_WITH_SHARE = 0.3, 0.5


@dataclass(slots=True)
class _MovingPatch:
    """A patch that may be a hand.

    at_s: last time of a hand's motion; p_face: face of its person; frames: number of such frames
    hand: the hand at that time
    entered: whether it touched the side of the image at its first motion; an arm of the person that
        moves there later does not reach in
    large_frames: successive frames in which it was too large for a hand at the person's distance
    wide_frames: number of frames in which it entered at the side and was too wide for that
    distance_share: its distance relative to the person's, from its size or that of the palm
    palm_s: last time at which a palm was found there
    sure_s: last time at which there was evidence of a hand
    """

    at_s: float
    p_face: Vec3
    hand: Located
    entered: bool
    frames: int = 0
    large_frames: int = 0
    wide_frames: int = 0
    distance_share: float = 1.0
    palm_s: float = -inf
    sure_s: float = -inf

    def update_distance(self, thing: Located, arm: "_Arm") -> None:
        """Update the distance from the size.

        Args:
            thing: the patch.
            arm: the patch at the person's distance.
        """
        if thing.depth_measured:
            return
        radius_m, wide_m = arm.ratio * thing.radius_m, arm.ratio * thing.thickness_m
        if arm.comes_in and self.entered:
            # The first frames decide. An arm that slows down looks thinner, as less of it moves,
            # but does not recede; a later change of its distance would look like motion along the
            # view.
            self.wide_frames += 1
            if self.wide_frames <= _WIDE_FRAMES:
                before = self.distance_share if self.wide_frames > 1 else 0.0
                self.distance_share = before + (_WIDE_M / wide_m - before) / self.wide_frames
        if self.wide_frames:
            return
        large = thing.compact and radius_m > _TOO_LARGE * _ALONE_M
        seen = _ALONE_M / radius_m if large else 1.0
        self.large_frames = self.large_frames + 1 if large else 0
        if self.large_frames == _LARGE_FRAMES:
            self.distance_share = min(self.distance_share, seen)
        elif self.large_frames == 0 or self.large_frames > _LARGE_FRAMES:
            self.distance_share += _NEARER_GAIN * (seen - self.distance_share)


class _RestingHand(NamedTuple):
    """A hand at rest, and the time until which it is kept."""

    hand: Located
    until_s: float


class Hands:
    """Recognition of moving patches as hands of the people in view.

    resting: the hands at rest by the number of the patch or palm
    """

    def __init__(self) -> None:
        self._moving: dict[int, _MovingPatch] = {}
        self.resting: dict[int, _RestingHand] = {}
        self._palm_mark, self._searched_s = 0, -inf

    def label(
        self,
        things: Sequence[Located],
        faces: list[Known],
        p_camera: Vec3,
        t_s: float,
        palms: Sequence[Located] | None = None,
    ) -> list[Located]:
        """Return the things; hands get the kind HAND and the position of the hand.

        Hands at rest are at the end of the list.

        Args:
            things: moving things of a frame.
            faces: faces of the people in view.
            p_camera: position of the camera.
            t_s: time of the frame.
            palms: palms of the nearest person, None in a frame that was not searched for them.
        """
        self._moving = {
            mark: one for mark, one in self._moving.items() if t_s - one.at_s <= _RESTS_S
        }
        if palms is not None:
            self._searched_s = t_s
        self._searched = t_s - self._searched_s < _HELD_S
        free = self._accept_palms(palms or (), faces, p_camera)
        self._walkers = sum(_approaches(one, p_camera) for one in things) > _MOST_COMING
        found = [self._label(thing, faces, p_camera, t_s, free) for thing in things]
        for palm in free:
            self._keep_palm(palm, found, p_camera, t_s)
        # Only hands at rest without motion; the detector finds moving hands again itself.
        marks = {thing.detector_id for thing in found}
        moving = [thing for thing in found if thing.detector_id in self._moving]
        self.resting = {
            mark: one
            for mark, one in self.resting.items()
            if mark in marks
            or (t_s <= one.until_s and not _moves_again(one.hand, moving, p_camera))
        }
        return found + [one.hand for mark, one in self.resting.items() if mark not in marks]

    def _accept_palms(
        self, palms: Sequence[Located], faces: list[Known], p_camera: Vec3
    ) -> list[Located]:
        """Return the accepted palms, no farther away than the nearest person.

        A hand that is turned aside looks smaller. A palm on the head (often a neck) or of low
        confidence is accepted only at the position of a recent hand.
        """
        if not palms or not faces:
            return [one for one in palms if one.confidence >= _SURE]
        p_face = min(
            [face[0] for face in faces], key=partial(_horizontal_distance_m, p_camera=p_camera)
        )
        far, found = _horizontal_distance_m(p_face, p_camera), []
        for palm in palms:
            there = _place_at_distance(palm, far, p_camera)
            on_head = hypot(*_offset_from_face(there, p_face)) < _HEAD_M
            if _horizontal_distance_m(palm.p_m, p_camera) > far:
                palm = palm._replace(p_m=there)
            if (palm.confidence >= _SURE and not on_head) or self._is_recent(palm, p_camera):
                found.append(palm)
        return found

    def _is_recent(self, thing: Located, p_camera: Vec3) -> bool:
        hands = [one.hand for one in self._moving.values() if one.frames >= _FRAMES]
        hands += [one.hand for one in self.resting.values()]
        return any(_distance_from_hand(thing, hand, p_camera) < _AGAIN_M for hand in hands)

    def _keep_palm(self, palm: Located, found: list[Located], p_camera: Vec3, t_s: float) -> None:
        """Keep a palm without a patch until the next search, under the number of its hand."""
        if any(_is_at(palm, thing, p_camera) for thing in found if thing.kind == HAND):
            return
        mark = next((m for m, o in self.resting.items() if _is_at(palm, o.hand, p_camera)), None)
        if mark is None:
            self._palm_mark -= 1
            mark = self._palm_mark
        hand = palm._replace(detector_id=mark, v_m_s=_STILL)
        self.resting[mark] = _RestingHand(hand, t_s + _PALM_S)

    def _label(
        self,
        thing: Located,
        faces: list[Known],
        p_camera: Vec3,
        t_s: float,
        palms: list[Located],
    ) -> Located:
        """Return a patch with its kind; its palm, if any, is removed from the given palms."""
        if thing.kind != UNNAMED or thing.detector_id is None or not faces:
            return thing
        known = self._moving.get(thing.detector_id)
        arm = _arm_of(thing, faces, p_camera, None if known is None else known.p_face)
        if arm is None:
            return thing
        p_face, v_face = arm.face[0], arm.face[1] or _STILL
        speed = norm(perpendicular(sub(arm.tip_m_s, v_face), unit(sub(arm.tip_m, p_camera))))
        named = known is not None and known.frames >= _FRAMES
        begins = (
            _BEFORE_HEAD_M_S
            if hypot(*_offset_from_face(arm.tip_m, p_face)) < _HEAD_M
            else _BEGINS_M_S
        )
        # Relative to a walking person, legs and parts of the trunk are not faster than this.
        comes = not self._walkers and (
            arm.ratio * thing.radius_m >= _ALONE_M and _approaches(thing, p_camera)
        )
        palm = next((one for one in palms if _is_at(one, thing, p_camera)), None)
        if (
            palm is not None
            or comes
            or speed > (_STAYS_M_S if named else max(begins, norm(v_face)))
        ):
            new = _MovingPatch(t_s, p_face, thing, thing.from_side)
            known = self._moving.setdefault(thing.detector_id, new)
            before_s, known.at_s, known.p_face = known.at_s, t_s, p_face
            if palm is not None:
                palms.remove(palm)
                known.palm_s = t_s
                known.distance_share = _horizontal_distance_m(
                    palm.p_m, p_camera
                ) / _horizontal_distance_m(arm.tip_m, p_camera)
            elif t_s - known.palm_s > _PALM_S:
                known.update_distance(thing, arm)
            hand = _as_hand(thing, arm, known.distance_share, p_camera)
            if palm is not None:
                hand = hand._replace(p_m=palm.p_m, along_sd_m=palm.along_sd_m)
            elif t_s - known.palm_s <= _PALM_S:
                # The palm that was seen is more certain than the end of the arm.
                way = scale(hand.v_m_s or _STILL, t_s - before_s)
                hand = hand._replace(p_m=add(known.hand.p_m, way))
            known.hand = hand
            sure = comes or palm is not None
            if sure or self._is_arm(thing, arm, p_camera):
                known.frames += _FRAMES if sure else 1
                known.sure_s = t_s
            elif self._searched and t_s - known.sure_s > _MISSED_S:
                known.frames = 0
        if known is None or known.frames < _FRAMES:
            return thing
        if speed >= _AT_REST_M_S:
            self.resting.pop(thing.detector_id, None)
            return known.hand
        # A patch that hardly moves may be the whole person: the hand stays at its last motion, and
        # is kept no longer than a palm if palms are searched.
        until_s = t_s + _HELD_S
        if self._searched:
            until_s = known.at_s + _PALM_S
        if t_s > until_s:
            self.resting.pop(thing.detector_id, None)
            return thing
        still = known.hand._replace(v_m_s=_STILL)
        self.resting[thing.detector_id] = _RestingHand(still, until_s)
        return known.hand if known.at_s == t_s else still

    def _is_arm(self, thing: Located, arm: "_Arm", p_camera: Vec3) -> bool:
        """Return whether a patch is an arm, at a palm, or the remainder of a recent hand.

        Where palms are searched, only a palm is evidence.
        """
        if not self._searched:
            small = arm.ratio * thing.radius_m <= _TOO_LARGE * _ALONE_M
            if arm.attached or arm.comes_in or (small and self._is_recent(thing, p_camera)):
                return True
        return any(
            _is_at(one.hand, thing, p_camera) for mark, one in self.resting.items() if mark < 0
        )


def _is_at(palm: Located, thing: Located, p_camera: Vec3) -> bool:
    """Return whether a patch or a hand is at a palm."""
    far = _horizontal_distance_m(palm.p_m, p_camera)
    if thing.depth_measured and abs(_horizontal_distance_m(thing.p_m, p_camera) - far) > _REACH_M:
        return False
    radius_m = thing.radius_m * far / _horizontal_distance_m(thing.p_m, p_camera)
    if _distance_from_hand(thing, palm, p_camera) < _AT_PALM_M + radius_m:
        return True
    if thing.kind != UNNAMED or thing.fastest_m is None:
        return False
    return _distance_from_hand(thing._replace(p_m=thing.fastest_m), palm, p_camera) < _AT_PALM_M


def _distance_from_hand(thing: Located, hand: Located, p_camera: Vec3) -> float:
    """Return the distance of a thing from a hand; unmeasured depth counts as the hand's."""
    place = _place_at_distance(thing, _horizontal_distance_m(hand.p_m, p_camera), p_camera)
    return norm(sub(place, hand.p_m))


def _moves_again(hand: Located, found: list[Located], p_camera: Vec3) -> bool:
    """Return whether a hand moves at the position of one at rest, as far as known."""
    for one in found:
        nearer, farther = sorted((hand, one), key=lambda h: _horizontal_distance_m(h.p_m, p_camera))
        if one.kind == HAND and _distance_from_hand(nearer, farther, p_camera) < _AGAIN_M:
            return True
    return False


class _Arm(NamedTuple):
    """A patch as the arm of a person.

    face: face of the person; tip_m, tip_m_s: position and velocity of its fastest part, at the
        person's distance
    ratio: length at that distance per length of the patch
    attached: whether it has an arm's size, points to the shoulder and is fastest at its end
    comes_in: whether it enters at the side, not from the shoulder, too wide for an arm there
    """

    face: Known
    tip_m: Vec3
    tip_m_s: Vec3
    ratio: float
    attached: bool
    comes_in: bool


def _arm_of(thing: Located, faces: list[Known], p_camera: Vec3, last: Vec3 | None) -> _Arm | None:
    """Return a patch as an arm of its likely person, None without one.

    last: face of the owner in the previous frame, who remains the owner
    """
    p_tip = thing.p_m if thing.fastest_m is None else thing.fastest_m
    v_tip = thing.v_m_s if thing.fastest_m_s is None else thing.fastest_m_s
    away = _horizontal_distance_m(p_tip, p_camera)
    best, least = None, inf
    for face in faces:
        far, ratio = _horizontal_distance_m(face[0], p_camera), 1.0
        if not thing.depth_measured:
            ratio = far / away
        elif abs(away - far) > _REACH_M + 2.0 * thing.along_sd_m:
            continue
        tip = add(p_camera, scale(sub(p_tip, p_camera), ratio))
        aside, up = _offset_from_face(tip, face[0])
        large = ratio * thing.radius_m >= _LARGEST_M
        if large or not -_BELOW_M < up < _ABOVE_M or hypot(aside, up) >= _REACH_M:
            continue
        # The arm continues from the hand through the patch's centre to the shoulder.
        middle = add(p_camera, scale(sub(thing.p_m, p_camera), ratio))
        aside, up = _offset_from_face(sub(scale(middle, 2.0), tip), face[0])
        shoulder_m = hypot(aside - _SHOULDER_ASIDE_M, up + _SHOULDER_BELOW_M)
        off_m = shoulder_m
        if last is not None and norm(sub(last, face[0])) < _SAME_M:
            off_m -= _REACH_M
        if off_m < least:
            v = _STILL if v_tip is None else scale(v_tip, ratio)
            slower_m_s = _AS_FAST * ratio * norm(thing.v_m_s or _STILL)
            attached = (
                shoulder_m < _ATTACHED_M
                and ratio * thing.radius_m > _SMALLEST_M
                and norm(v) >= slower_m_s
            )
            wide = ratio * thing.thickness_m > _TOO_WIDE * _WIDE_M
            comes_in = thing.from_side and shoulder_m > _ANOTHERS_M and wide
            best, least = _Arm(face, tip, v, ratio, attached, comes_in), off_m
    return best


def _as_hand(thing: Located, arm: _Arm, nearer: float, p_camera: Vec3) -> Located:
    """Return a patch as a hand at its fastest part.

    Args:
        thing: the patch.
        arm: the patch at the person's distance.
        nearer: its distance relative to the person's.
        p_camera: position of the camera.
    """
    return thing._replace(
        kind=HAND,
        p_m=add(p_camera, scale(sub(arm.tip_m, p_camera), nearer)),
        v_m_s=scale(arm.tip_m_s, nearer),
        radius_m=_HAND_RADIUS_M,
        spin_rad_s=0.0,
        across_sd_m=_ACROSS_SD_M,
        along_sd_m=thing.along_sd_m if thing.depth_measured else _ALONG_SD_M * nearer,
        across_sd_m_s=nearer * arm.ratio * thing.across_sd_m_s,
        along_sd_m_s=nearer * arm.ratio * thing.along_sd_m_s,
    )


def _place_at_distance(thing: Located, far_m: float, p_camera: Vec3) -> Vec3:
    """Return the position of a thing at a distance, or at its own distance if that was measured."""
    if thing.depth_measured:
        return thing.p_m
    ratio = far_m / _horizontal_distance_m(thing.p_m, p_camera)
    return add(p_camera, scale(sub(thing.p_m, p_camera), ratio))


def _horizontal_distance_m(p_m: Vec3, p_camera: Vec3) -> float:
    return max(hypot(p_m[0] - p_camera[0], p_m[1] - p_camera[1]), 1e-6)


def _offset_from_face(p_m: Vec3, p_face: Vec3) -> tuple[float, float]:
    """Return the offset of a position from a face: aside and above."""
    x, y, z = sub(p_m, p_face)
    return hypot(x, y), z


def _approaches(thing: Located, p_camera: Vec3) -> bool:
    """Return whether a patch certainly grows as fast as an approaching hand."""
    if thing.v_m_s is None:
        return False
    way = sub(thing.p_m, p_camera)
    closing_m_s = -dot(thing.v_m_s, unit(way)) - _SURE_SD * thing.along_sd_m_s
    return closing_m_s > _COMES_1_S * norm(way)


def without_own_motion(
    faces: list[Located], things: Iterable[Located], known: list[Known], p_camera: Vec3
) -> tuple[list[Located], list[Located], list[tuple[int, Located]]]:
    """Return the faces with the spin of their own motion, and the things that belong to no face.

    known: the faces from ``known_faces``

    Returns:
        Faces, things, and the patches of people who are only tracked, each with its index there.
    """
    spins = [0.0] * len(faces)
    others: list[Located] = []
    carried: list[tuple[int, Located]] = []
    for thing in things:
        owner = _owner(thing, known, p_camera)
        if owner is None:
            others.append(thing)
        elif owner >= len(faces):
            carried.append((owner - len(faces), thing))
        else:
            off = _offset_of_patch(thing, known[owner][0], p_camera)
            if off is not None and hypot(*off) < _HEAD_M:
                spins[owner] = max(spins[owner], thing.spin_rad_s, key=abs)
    turned = [
        face._replace(spin_rad_s=spin) if spin != 0.0 else face
        for face, spin in zip(faces, spins, strict=True)
    ]
    return turned, others, carried


def known_faces(faces: list[Located], tracked: Sequence[Known]) -> list[Known]:
    """Return the faces of a frame with the velocities of their tracks, and those tracks.

    A face that the detector has just missed still owns its body's motion.

    tracked: tracked faces at their positions predicted for now
    """
    found = []
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
        if (off := _offset_of_patch(thing, p_face, p_camera)) is None:
            continue
        if hypot(*off) < _HEAD_M:
            return k
        on_body = off[0] < _BODY_HALF_M and -_BODY_BELOW_M < off[1] < _BODY_ABOVE_M
        if on_body and _moves_along(thing, p_face, v_face, p_camera):
            return k
    return None


def _offset_of_patch(thing: Located, p_face: Vec3, p_camera: Vec3) -> tuple[float, float] | None:
    """Return the sideways and upward offset of a patch from a face; None if its depth differs.

    A patch whose distance is only assumed is placed at the face's distance.
    """
    far = norm(sub(p_face, p_camera))
    way = sub(thing.p_m, p_camera)
    if thing.depth_measured and abs(norm(way) - far) > _DEEP_M + 2.0 * thing.along_sd_m:
        return None
    return _offset_from_face(add(p_camera, scale(unit(way), far)), p_face)


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
