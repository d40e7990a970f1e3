"""Who addresses the head: a person who looks at it, from near by, and talks with nobody else.

People look at the one to whom they speak: a speaker's gaze is on the addressee in 77 % of the time
(Vertegaal et al. 2001), and a look longer than a glance is an offer to talk (Kendon & Ferber 1973).
So a person addresses the head with a look of .6 s from the distances of personal and near social
talk (Hall 1966), and still does while the gaze is averted for a moment, as speakers' is.

People who talk with each other glance at what is near them. Who looks at another person talks, and
so does the other one if the looking person speaks, or if the other's face is not visible: two
people in talk are turned to each other, and so at least one of them away from the head. Both must
have finished before one of them addresses the head. A look is enough, because lips are too small
to be read from 2 m on.

A face counts only if it has moved since it came into view and shows life: a poster looks at
everybody, for longer than any person.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import dist, inf, radians

from msgspec import Struct

from gazerig.gaze.attention.persons import faced_person
from gazerig.gaze.types import Face, Percept, Vec3

LOOK_S = 0.6
"""Shortest look that addresses the head."""
KEEPS_S = 1.5
"""Time after the look in which the person still addresses the head."""
_SEEN_LATE_S = 0.15
"""Time by which perception sees a look late, at 30 pictures a second: the turn of a face is
smoothed, and must be well within the cone.
"""
NEAR_M = 2.5
"""Largest distance from which a person addresses the head."""

_GAP_S = 0.3
"""Time without a result on the look, or a detection, that does not interrupt it."""
_ABSENT_S = 0.5
"""Time without a sight of the person, after which that person has left."""
_TALKS_S = 2.0
"""Time after a look in a talk with somebody else for which that talk still goes on."""
_AT_PERSON_RAD = radians(45.0)
"""Largest angle of the face to the person at whom it looks: eyes turn farther than the head, and
the pose of a face that is seen from the side is measured too small."""
_REMEMBERED_S = 60.0
"""Time for which a person who is turned away, and so not seen, counts as still there: in a talk
that is seen from the side a face is lost for half a minute."""


class Addressing(Struct, frozen=True, gc=False):
    """A person who addresses the head.

    Attributes:
        person: Perception's number of the person.
        since_s: Beginning of the look.
        confidence: Confidence of the detector in the face, less with the time since the look, 0..1.
    """

    person: int
    since_s: float
    confidence: float


@dataclass(slots=True)
class _Look:
    """Looks of one person.

    began_s, looked_s: beginning of the present look at the head, inf without one, and its last
        frame
    seen_s, p_world_m: last sight of the person, and the place
    talked_s: last look in a talk with somebody else
    """

    began_s: float = inf
    looked_s: float = -inf
    seen_s: float = -inf
    talked_s: float = -inf
    p_world_m: Vec3 = (0.0, 0.0, 0.0)
    confidence: float = 0.0


class AddressingModel:
    """Recognition of the people who address the head, from what perception sees."""

    def __init__(self) -> None:
        self._looks: dict[int, _Look] = {}
        self._since_s: dict[int, float] = {}
        self._at_s = -inf

    def step(
        self, percept: Percept | None, p_world_head_m: Vec3, t_s: float
    ) -> tuple[Addressing, ...]:
        """Return the people who address the head, the one who began first in front.

        That person keeps the head until the end: an agent answers one person at a time, and a
        second one who joins in would otherwise take the first one's turn.
        """
        if percept is not None and percept.captured_s != self._at_s:
            self._at_s = percept.captured_s
            self._update(percept, p_world_head_m)
        for id in [id for id in self._since_s if self._has_ended(self._looks[id], t_s)]:
            del self._since_s[id]
        return tuple([self._addressing(id, since_s, t_s) for id, since_s in self._since_s.items()])

    def _addressing(self, id: int, since_s: float, t_s: float) -> Addressing:
        look = self._looks[id]
        share = 1.0 - max(0.0, t_s - look.looked_s) / KEEPS_S
        return Addressing(id, since_s, look.confidence * share)

    @staticmethod
    def _has_ended(look: _Look, t_s: float) -> bool:
        return t_s - look.looked_s > KEEPS_S or t_s - look.seen_s > _ABSENT_S

    def _update(self, percept: Percept, p_head: Vec3) -> None:
        """Update with a new frame."""
        now_s, bodies = percept.captured_s, percept.bodies
        rows = bodies.rows()
        for id, kind, p in zip(rows.ids, rows.kinds, rows.p_world_m, strict=True):
            if kind == "face":
                look = self._looks.setdefault(id, _Look())
                look.seen_s, look.p_world_m = now_s, p
        self._looks = {
            id: look
            for id, look in self._looks.items()
            if id in self._since_s or now_s - look.seen_s <= _REMEMBERED_S
        }
        places = {id: look.p_world_m for id, look in self._looks.items()}
        for id in _people_in_talk(percept.faces, places):
            self._looks[id].talked_s = now_s
        for face in percept.faces:
            look = self._looks[face.id]
            near = dist(face.p_world_m, p_head) <= NEAR_M
            living = face.has_moved and face.id not in bodies.lifeless
            if face.looks_at_head and near and living:
                if look.began_s == inf or now_s - look.looked_s > _GAP_S:
                    look.began_s = now_s - _SEEN_LATE_S
                look.looked_s, look.confidence = now_s, face.confidence
                silent = now_s - look.talked_s > _TALKS_S
                if now_s - look.began_s >= LOOK_S and silent:
                    self._since_s.setdefault(face.id, look.began_s)
            elif face.looks_at_head is False or not living:
                look.began_s = inf


def _people_in_talk(seen: Sequence[Face], places: dict[int, Vec3]) -> Iterator[int]:
    """Yield the people who now talk with another person.

    Args:
        seen: Faces in view.
        places: Places of all people by number, also of those who sit so still that no life was
            seen for seconds, and of those who were in view a while ago.
    """
    faces = {face.id: face for face in seen}
    partners = {
        id: _partner(face, places)
        for id, face in faces.items()
        if id in places and not face.looks_at_head
    }
    for id, other in partners.items():
        if other is not None:
            yield id
            if faces[id].speaks or other not in faces:
                yield other


def _partner(face: Face, places: dict[int, Vec3]) -> int | None:
    """Return the person at whom a person looks, None if nobody is nearer to it than the head."""
    off_rad, id = faced_person(face, places)
    return id if off_rad < min(_AT_PERSON_RAD, face.off_head_rad or 0.0) else None
