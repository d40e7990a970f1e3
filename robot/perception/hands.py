"""Hands, as far as motion shows them: what moves otherwise than a person, within their reach.

A camera without a hand detector shows a moving arm as one patch of flow. The quarter of it that
moves fastest is taken to be the hand, as far away as the person's face is, unless the distance was
measured. What a hand is called it keeps for as long as the detector's number of it lasts and it
moves now and then; so a track does not break where a hand turns or passes before the face. A hand
that has come to rest is still there for a while, though flow shows nothing that stands still.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import hypot
from typing import NamedTuple

from gazerig.gaze.angles import add, dot, norm, scale, sub, unit
from gazerig.gaze.types import Vec3
from gazerig.robot.perception.tracker import UNNAMED, LocalisedDetection

HAND = "hand"
Known = tuple[Vec3, Vec3 | None]
"""Place of a face in the world, and its velocity where it is known."""

# Where hands are, from the face: aside, and above; legs and feet are below.
_REACH_M, _ABOVE_M, _BELOW_M = 0.85, 0.7, 0.8
# An arm, a hand: as large as this at most (radius of a disc of the same area).
_LARGEST_M = 0.24
# How much faster than the person across the view: to be taken for a hand, to remain one, and to be
# taken for one before the head, which moves itself when it turns or nods.
_BEGINS_M_S, _STAYS_M_S, _BEFORE_HEAD_M_S = 0.4, 0.2, 1.5
_HEAD_M = 0.25
_SHOULDER_ASIDE_M, _SHOULDER_BELOW_M = 0.19, 0.17
_SAME_M = 0.3
"""A face so near to where one was a frame ago is the same."""
# Seen to move so in so many frames within the time for which a rest is bridged.
_FRAMES, _RESTS_S = 2, 0.4
# A hand that was last seen slower than this has come to rest, and is there for so long; what moves
# so near to it is the hand again.
_AT_REST_M_S, _HELD_S, _AGAIN_M = 0.4, 2.0, 0.3
_HAND_RADIUS_M = 0.07
_ACROSS_SD_M, _ALONG_SD_M = 0.04, 0.25


@dataclass(slots=True)
class _Moving:
    """A patch that may be a hand.

    at_s: when it last moved as one; p_face: of whom it is; frames: in how many it moved so
    hand: where it was then
    """

    at_s: float
    p_face: Vec3
    hand: LocalisedDetection
    frames: int = 0


class _Held(NamedTuple):
    """A hand that has come to rest, and when it was seen last."""

    hand: LocalisedDetection
    seen_s: float


class Hands:
    """Which moving patches are hands of the people in view."""

    def __init__(self) -> None:
        self._moving: dict[int, _Moving] = {}
        self._held: dict[int, _Held] = {}

    def named(
        self,
        things: Iterable[LocalisedDetection],
        faces: list[Known],
        p_camera: Vec3,
        t_s: float,
    ) -> list[LocalisedDetection]:
        """Return the things, those that are hands by this name and where the hand is.

        Behind them come hands that do not move any more.

        Args:
            things: what moves in a frame.
            faces: of the people in view.
            p_camera: from where it was seen.
            t_s: when.
        """
        self._moving = {
            mark: one for mark, one in self._moving.items() if t_s - one.at_s <= _RESTS_S
        }
        found = [self._named(thing, faces, p_camera, t_s) for thing in things]
        return [*found, *self._at_rest(found, t_s)] if self._held else found

    @property
    def held(self) -> bool:
        """Return whether there are hands that do not move any more."""
        return bool(self._held)

    def _at_rest(self, found: list[LocalisedDetection], t_s: float) -> list[LocalisedDetection]:
        """Return the hands that have come to rest and are not seen to move."""
        marks = {thing.mark for thing in found}
        self._held = {
            mark: one
            for mark, one in self._held.items()
            if mark in marks or (t_s - one.seen_s <= _HELD_S and not _moves_again(one.hand, found))
        }
        return [one.hand for mark, one in self._held.items() if mark not in marks]

    def _named(
        self, thing: LocalisedDetection, faces: list[Known], p_camera: Vec3, t_s: float
    ) -> LocalisedDetection:
        if thing.kind != UNNAMED or thing.mark is None or not faces:
            return thing
        hand, known = _as_hand(thing), self._moving.get(thing.mark)
        last = None if known is None else known.p_face
        owner = _owner(hand, thing, faces, p_camera, last)
        if owner is None:
            return thing
        p_face, v_face = owner
        placed = _as_far(hand, _level(p_face, p_camera), p_camera)
        v_face = v_face or (0.0, 0.0, 0.0)
        speed = _across(placed, v_face, p_camera)
        named = known is not None and known.frames >= _FRAMES
        aside, up = _off(placed.p_world_m, p_face)
        begins = _BEFORE_HEAD_M_S if hypot(aside, up) < _HEAD_M else _BEGINS_M_S
        # Legs and parts of the trunk of somebody who walks are no faster than that, seen from them.
        if speed > (_STAYS_M_S if named else max(begins, norm(v_face))):
            known = self._moving.setdefault(thing.mark, _Moving(t_s, p_face, placed))
            known.at_s, known.p_face, known.hand = t_s, p_face, placed
            known.frames += 1
        if known is None or known.frames < _FRAMES:
            return thing
        if speed >= _AT_REST_M_S:
            self._held.pop(thing.mark, None)
            return placed
        # A patch that hardly moves may be all of the person: the hand is where it moved last.
        still = replace(known.hand, v_world_m_s=(0.0, 0.0, 0.0))
        self._held[thing.mark] = _Held(still, t_s)
        return placed if known.at_s == t_s else still


def _moves_again(hand: LocalisedDetection, found: list[LocalisedDetection]) -> bool:
    """Return whether something moves where a hand has come to rest, as far as that is known."""
    return any(
        thing.kind == HAND and norm(sub(thing.p_world_m, hand.p_world_m)) < _AGAIN_M
        for thing in found
    )


def _as_hand(thing: LocalisedDetection) -> LocalisedDetection:
    """Return a patch as a hand at its fastest part."""
    p, v = thing.fastest_m, thing.fastest_m_s
    return replace(
        thing,
        kind=HAND,
        p_world_m=thing.p_world_m if p is None else p,
        v_world_m_s=thing.v_world_m_s if v is None else v,
        radius_m=_HAND_RADIUS_M,
        spin_rad_s=0.0,
        across_sd_m=_ACROSS_SD_M,
    )


def _owner(
    hand: LocalisedDetection,
    thing: LocalisedDetection,
    faces: list[Known],
    p_camera: Vec3,
    last: Vec3 | None,
) -> Known | None:
    """Return the face of the person whose hand it may be, None where there is none.

    hand, thing: the fastest part of a patch, and the patch
    last: face of the owner in the frame before; they remain it
    """
    found: list[tuple[float, Known]] = []
    for face in faces:
        far, away = _level(face[0], p_camera), _level(hand.p_world_m, p_camera)
        if hand.depth_measured and abs(away - far) > _REACH_M + 2.0 * hand.along_sd_m:
            continue
        size = thing.radius_m * (1.0 if hand.depth_measured else far / away)
        tip = _as_far(hand, far, p_camera).p_world_m
        aside, up = _off(tip, face[0])
        if size < _LARGEST_M and -_BELOW_M < up < _ABOVE_M and hypot(aside, up) < _REACH_M:
            middle = _as_far(thing, far, p_camera).p_world_m
            # The arm goes on from the hand over the patch's middle to the shoulder.
            aside, up = _off(sub(scale(middle, 2.0), tip), face[0])
            off_m = hypot(aside - _SHOULDER_ASIDE_M, up + _SHOULDER_BELOW_M)
            stays = last is not None and norm(sub(last, face[0])) < _SAME_M
            found.append((off_m - (_REACH_M if stays else 0.0), face))
    return min(found, key=lambda one: one[0])[1] if found else None


def _as_far(hand: LocalisedDetection, far_m: float, p_camera: Vec3) -> LocalisedDetection:
    """Return a hand whose distance was not measured as far away as the person, who is upright."""
    if hand.depth_measured:
        return hand
    way = sub(hand.p_world_m, p_camera)
    ratio = far_m / _level(hand.p_world_m, p_camera)
    v = hand.v_world_m_s
    return replace(
        hand,
        p_world_m=add(p_camera, scale(way, ratio)),
        v_world_m_s=None if v is None else scale(v, ratio),
        across_sd_m_s=hand.across_sd_m_s * ratio,
        along_sd_m_s=hand.along_sd_m_s * ratio,
        along_sd_m=_ALONG_SD_M,
    )


def _level(p_m: Vec3, p_camera: Vec3) -> float:
    """Return how far away a place is, its height apart."""
    return max(hypot(p_m[0] - p_camera[0], p_m[1] - p_camera[1]), 1e-6)


def _off(p_m: Vec3, p_face: Vec3) -> tuple[float, float]:
    """Return how far aside of and above a face a place is."""
    x, y, z = sub(p_m, p_face)
    return hypot(x, y), z


def _across(hand: LocalisedDetection, v_face: Vec3, p_camera: Vec3) -> float:
    """Return how fast a hand moves across the view, seen from the person."""
    if hand.v_world_m_s is None:
        return 0.0
    view = unit(sub(hand.p_world_m, p_camera))
    other = sub(hand.v_world_m_s, v_face)
    return norm(sub(other, scale(view, dot(other, view))))
