"""Persons selected by behaviour: the nearest, waving ones, those who look at the head, the newest.

Rules can select people by these traits (gazerig.gaze.attention.top_down), independently of the
tracker's numbers.

A hand waves when its velocity across the view has changed sides twice within a little more than a
second, faster than a hand that only gestures, and at the height of the face; the person who waves
is the one with the face nearest to it. Each further change of side of a hand at the face makes its
motion less new: people look less and less at repeated motion (Neo & Chua 2006).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import dist, exp, hypot, inf

from gazerig.gaze.angles import add, angle_between, norm, scale, sub, transpose
from gazerig.gaze.types import BodyRows, Face, Percept, Vec3

NEAREST, WAVING, LOOKING, NEWEST = "nearest", "waving", "looking", "newest"
TRAITS = (NEAREST, WAVING, LOOKING, NEWEST)

_WAVES_M_S = 0.25
_TURNS, _TURNS_WITHIN_S = 2, 1.2
_WAVED_S = 1.5
"""Time for which a person counts as waving after the hand's last turn."""
_ARM_M = 0.9
_HELD_OUT = 0.65
"""A hand nearer than this share of the face's distance reaches out; hands in signs and gestures are
farther away.
"""
_RAISED_M = 0.08
"""A hand is raised if it is at most this far below the face's centre; signs are lower."""
_GESTURES_M_S, _GESTURES_S, _GESTURES = 0.25, 2.0, 0.5
"""A person gestures if the lower hands were faster than this, in this time window, for this share.
"""
_SANK_S = 0.3
"""Time for which a hand counts as moving down after its last downward motion."""
_KNOWN, _KNOWN_S = 0.5, 2.0
"""Factor of a hand's salience at each further reversal of its motion near the face, and time
constant with which that salience recovers.
"""
_TOGETHER_S = 0.5
"""People who appear within this time of each other came together."""
_CLEARLY_NEARER = 1.1
_TALKS_S = 6.0
"""Silence after which a talk has ended."""
_AWAY_S, _NEW_S = 3.0, 2.0
"""Absence after which a person returns; time after that, or an appearance, for which one is new."""
_GONE_S = 120.0


@dataclass(slots=True)
class _SeenPerson:
    """A person: times of appearance, return, last sight and wave; share of time with gestures."""

    came_s: float
    back_s: float = -inf
    seen_s: float = -inf
    waved_s: float = -inf
    gestures: float = 0.0


@dataclass(slots=True)
class _Hand:
    """Motion of a body other than a face: its side, and the times of its changes of side.

    sank_s: last motion down
    repeats: number of changes of side soon after another one; it decays over time
    """

    side: float = 0.0
    turned_s: list[float] = field(default_factory=list)
    seen_s: float = -inf
    sank_s: float = -inf
    repeats: float = 0.0


class Persons:
    """Behaviour of the people in view.

    Attributes:
        parts: for a body that moves within a person's reach, the id of that person's face; without
            bodies that reach out towards the head or are raised to the face.
        raised: ids of bodies that move within a person's reach at the height of the face; without
            hands of a person who gestures and does not wave, as signs also reach the face.
        speaking: ids of the people in view who speak.
        new: ids of those who have just appeared or returned.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all people."""
        self._people: dict[int, _SeenPerson] = {}
        self._hands: dict[int, _Hand] = {}
        self.parts: dict[int, int] = {}
        self.raised: set[int] = set()
        self.new: set[int] = set()
        self.speaking: frozenset[int] = frozenset()
        self._spoke, self._spoke_s = self.speaking, -inf
        self._faces: tuple[Face, ...] = ()
        self._nearest = -1
        self._at_s = -inf

    def update(self, percept: Percept, p_world_eye_m: Vec3) -> None:
        """Update with a new frame.

        Args:
            percept: percept of the frame.
            p_world_eye_m: position of the eye.
        """
        rows, dt_s = percept.bodies.rows(), percept.captured_s - self._at_s
        self._at_s = percept.captured_s
        faces = _face_places(rows)
        for id in faces:
            person = self._people.setdefault(id, _SeenPerson(self._at_s))
            if self._at_s - person.seen_s > _AWAY_S:
                person.back_s = self._at_s
            person.seen_s = self._at_s
        self.new = {id for id in faces if self._at_s - self._people[id].back_s < _NEW_S}
        self._faces = percept.faces
        self.speaking = frozenset(face.id for face in percept.faces if face.speaks)
        if self.speaking:
            self._spoke, self._spoke_s = self.speaking, self._at_s
        for hand in self._hands.values():
            hand.repeats *= exp(-max(0.0, dt_s) / _KNOWN_S)
        away = {id: dist(p, p_world_eye_m) for id, p in faces.items()}
        nearest = min(away, key=lambda one: away[one], default=-1)
        if nearest < 0 or away.get(self._nearest, inf) > _CLEARLY_NEARER * away[nearest]:
            self._nearest = nearest
        self.parts, self.raised = {}, set()
        moving: set[int] = set()
        for row, id in enumerate(rows.ids):
            if faces and id not in faces:
                p, v = rows.p_world_m[row], rows.v_world_m_s[row]
                reach_m = _ARM_M / 2.0 if id in percept.bodies.cut_off else _ARM_M
                low_of = self._update_part(id, p, faces, p_world_eye_m, reach_m)
                hand = self._update_hand(id, p, v, faces, p_world_eye_m)
                if rows.kinds[row] == "hand" and norm(v) > _GESTURES_M_S:
                    moving.add(low_of)
                    if -v[2] > max(_GESTURES_M_S, hypot(*v[:2])):
                        hand.sank_s = self._at_s
        share = min(1.0, dt_s / _GESTURES_S)
        for id in faces:
            person = self._people[id]
            person.gestures += share * ((id in moving) - person.gestures)
        self._drop_old()

    def ids_with_trait(self, trait: str) -> frozenset[int]:
        """Return the ids of the people with a trait.

        Args:
            trait: one of TRAITS.
        """
        people = self._people
        if trait == LOOKING:
            return frozenset(face.id for face in self._faces if face.looks_at_head)
        if trait == WAVING:
            return frozenset(id for id in people if self._waves(id))
        if trait == NEAREST:
            return frozenset((self._nearest,)) if self._nearest >= 0 else frozenset()
        latest_s = max((one.came_s for one in people.values()), default=-inf)
        return frozenset(id for id, one in people.items() if latest_s - one.came_s < _TOGETHER_S)

    def _waves(self, id: int) -> bool:
        return self._at_s - self._people[id].waved_s <= _WAVED_S

    def may_speak(self, rows: BodyRows) -> frozenset[int]:
        """Return the people who may speak, as nobody is seen to speak.

        They are those at whom others look in a talk, also out of view, but not the last speaker;
        otherwise those out of view who have not been observed to be silent since the last turn.

        rows: the bodies in view and the remembered ones
        """
        places, watched = _face_places(rows), set()
        for face in self._faces if self._at_s - self._spoke_s < _TALKS_S else ():
            off_rad, id = faced_person(face, places)
            if off_rad < (face.off_head_rad or 0.0):
                watched.add(id)
        unseen = (id for id in places if self._people[id].seen_s < self._spoke_s)
        return frozenset(watched - self._spoke) or frozenset(unseen)

    def _update_hand(
        self, id: int, place: Vec3, v_m_s: Vec3, faces: Mapping[int, Vec3], p_eye: Vec3
    ) -> _Hand:
        """Update a hand, and its waving person: the one with the nearest face."""
        hand = self._hands.setdefault(id, _Hand())
        hand.seen_s = self._at_s
        # Sideways as seen from the eye: level, and across the direction to the hand.
        ahead, aside = place[0] - p_eye[0], place[1] - p_eye[1]
        away = max((ahead * ahead + aside * aside) ** 0.5, 1e-6)
        across_m_s = (v_m_s[1] * ahead - v_m_s[0] * aside) / away
        if abs(across_m_s) < _WAVES_M_S or across_m_s * hand.side > 0.0:
            return hand
        turned, hand.side = hand.side != 0.0, across_m_s
        if not turned:
            return hand
        hand.turned_s = [at for at in hand.turned_s if self._at_s - at <= _TURNS_WITHIN_S]
        hand.turned_s.append(self._at_s)
        if len(hand.turned_s) >= _TURNS:
            if id in self.raised:
                hand.repeats += 1.0
            owner = min(faces, key=lambda face: dist(faces[face], place))
            if _is_raised(place, faces[owner]) and dist(faces[owner], place) < _ARM_M:
                self._people[owner].waved_s = self._at_s
        return hand

    def _update_part(
        self, id: int, place: Vec3, faces: Mapping[int, Vec3], p_eye: Vec3, reach_m: float
    ) -> int:
        """Update the owner of a body part: the person nearest to its line of sight.

        The distance of a moving body is often only assumed: it is compared at the face's distance.
        What is cut off by the picture's edge may belong to somebody outside it.

        Returns:
            The id of that person if it is lower than the face and does not reach out, otherwise -1.
        """
        away, towards = dist(place, p_eye), sub(place, p_eye)
        beside = {
            face: dist(add(p_eye, scale(towards, dist(p, p_eye) / max(away, 1e-3))), p)
            for face, p in faces.items()
        }
        owner = min(beside, key=lambda face: beside[face])
        if beside[owner] >= reach_m:
            return -1
        high = _is_raised(place, faces[owner])
        if high and (self._people[owner].gestures <= _GESTURES or self._waves(owner)):
            self.raised.add(id)
        elif away > _HELD_OUT * dist(faces[owner], p_eye):
            self.parts[id] = owner
            return -1 if high else owner
        return -1

    def weaken_known(self, factors: dict[int, float], repeats: bool, sinks: bool) -> None:
        """Lower the factors of hands that repeat their motion or move down.

        The first change of side soon after another is still new. A hand that moves down has no
        salience: it is at the end of its gesture.

        Args:
            factors: factor of each body by its id, changed in place.
            repeats: whether repeated motion counts for less.
            sinks: whether motion down does.
        """
        for id in factors.keys() & self._hands.keys():
            hand = self._hands[id]
            if sinks and self._at_s - hand.sank_s <= _SANK_S:
                factors[id] = 0.0
            if repeats and hand.repeats > 1.0:
                factors[id] *= _KNOWN ** (hand.repeats - 1.0)

    def _drop_old(self) -> None:
        """Drop people and hands that have not been visible for a long time."""
        self._people = {
            id: one for id, one in self._people.items() if self._at_s - one.seen_s <= _GONE_S
        }
        if len(self._hands) > len(self._people):
            self._hands = {
                id: hand for id, hand in self._hands.items() if self._at_s - hand.seen_s < _WAVED_S
            }


def _is_raised(place: Vec3, face: Vec3) -> bool:
    return place[2] > face[2] - _RAISED_M


def _face_places(rows: BodyRows) -> dict[int, Vec3]:
    """Return the positions of the faces among some bodies by their ids."""
    return {
        id: p
        for id, kind, p in zip(rows.ids, rows.kinds, rows.p_world_m, strict=True)
        if kind == "face"
    }


def faced_person(face: Face, places: Mapping[int, Vec3]) -> tuple[float, int]:
    """Return the angle from the line of sight to the nearest other person, inf, and who that is."""
    ahead = face.gaze_world or transpose(face.R_world_face)[0]
    others = [
        (angle_between(ahead, sub(p, face.p_world_m)), id)
        for id, p in places.items()
        if id != face.id
    ]
    return min(others, default=(inf, -1))
