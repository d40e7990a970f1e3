"""Gaze in a conversation: one law of looking away from a face, by role, and the turns that set it.

A gaze that never leaves a face is a stare. Therefore it alternates between a time on the face and
one beside it, whose durations, angles and directions are those of the present role, a row of the
table ``ROLES``:

none       Without a conversation two people who face each other prefer periods of mutual gaze of
           3.3 s (Binetti et al. 2016, n = 498, a median); no measurement of the looks away between
           them is known, a listener's short ones are used. While somebody is seen to speak, the
           head is a listener.
thinking   Thinking people look mostly up, for longer (Andrist et al. 2014: 70 % up, 20 down).
speaking   The numbers are those of 19 people in remote talk (Dembinsky et al. 2024, medians):
listening  speaking .45 of the time averted, 13.5 times a minute; listening .04, 3.2 times; three
           quarters of the looks go aside, most others up. Turns last some seconds,
           so times on the face are exponential: they are as likely to end early in a turn as late.

A look away starts when the rest on a part of the face is over, instead of the next shift between
parts, and goes beyond the outline of the face: a near face is wider than the published angles. The
eyes do not rest in it: they move from place to place, a speaker's or thinker's head takes a share
of .4 in it and others' .1 (Andrist et al. 2014), and something that moves near by ends it. A look
to where the person looks (gazerig.gaze.attention.followed_look) is a look away with a goal.

A voice agent reports its state. A thinker looks away immediately; most long turns begin averted
(Kendon 1967: more than 70 %), for the cognitive aversion of Andrist et al. 2014, and the gaze is on
the face again N(2.3, .5) s before the planned end (their turn yield). Such a look goes on if the
partner is another person than the one looked at.

Of several people a listener looks most at the one who speaks, a speaker at the addressee (Vertegaal
et al. 2001: 88 and 77 %). A side participant, whom the present speaker does not look at, is a
listener too: when another person begins to speak, the gaze shifts there (Holler & Kendrick 2015).

Nods of a listener are individual (Blomsma 2024): each head has its own rate. With
words, American listeners respond 7 times a minute, Japanese ones 15 times (Maynard 1990).
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, exp, hypot, inf, pi, radians, sin
from typing import Annotated, Literal, NamedTuple

import numpy as np
from msgspec.structs import replace

from gazerig.gaze.angles import add, angle_between, cross, dot, norm, scale, sub, unit
from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.followed_look import FollowedLook
from gazerig.gaze.draws import draw_lognormal
from gazerig.gaze.types import AWAY, Face, Percept, Target, TurnState, Vec3
from gazerig.params import Bounds

LooksAway = Literal["people", "none"]
MODES = ("none", "talk", "listen", "think")
"""Roles that a user can choose while no turns are reported."""


class Role(NamedTuple):
    """Numbers of one role.

    face_s, face_sd_s: mean and standard deviation of the time on the face; None: exponential
    away_s, away_sd_s: of the time away
    most_deg: largest angle of a look away
    ways: shares of looks that go aside, and up, the rest down
    head: share of the head in a look away
    """

    face_s: float
    face_sd_s: float | None
    away_s: float
    away_sd_s: float
    most_deg: float
    ways: tuple[float, float]
    head: float


_THINKS_UP, _SIDEWAYS = (0.10, 0.70), (0.78, 0.15)
_HEAD, _LESS_HEAD = 0.4, 0.1
ROLES = {
    "none": Role(3.62, 1.63, 0.60, 0.30, 22.7, _SIDEWAYS, _LESS_HEAD),
    "speaking": Role(3.20, None, 2.20, 0.90, 30.0, _SIDEWAYS, _HEAD),
    "listening": Role(20.0, None, 0.65, 0.30, 22.7, _SIDEWAYS, _LESS_HEAD),
    "thinking": Role(1.50, 0.80, 3.54, 1.26, 30.0, _THINKS_UP, _HEAD),
}
_ROLE_OF = {
    "talk": "speaking",
    "listen": "listening",
    "think": "thinking",
    "interrupted": "listening",
}
"""Chosen mode or reported state -> role; the others have its name."""

_LONGEST_S = 14.5
"""Longest time on the face; beyond 15 s it is a stare."""
_STAYS_S = 0.8
"""Shortest of the exponential times on the face."""
_SHORTEST_S = 0.2
"""Shortest time on the face or away, because eyes and servos need time to move."""
_BESIDE_DEG = 2.0
"""Smallest angle between a look away and the outline of the face."""
_DRIFT_DEG = 0.75
"""Motion of a person during a look away of a reported turn, which must stay beside the face."""

_LEAST_DEG, _SCALE_DEG = 7.5, 10.0
"""Smallest angle of a look away, and mean angle beyond the smallest of an exponential law, whose
form is that of Lee, Badler & Badler 2002 (Eyes Alive; 6.9 deg beyond 0). With these a speaker's
gaze spreads nearly as that of people, 9 x 5 deg (Dembinsky et al. 2024).
"""
_SPREAD_DEG = 30.0
"""Largest angle of a look between it and level, or straight up or down."""
_WANDERS_DEG = 15.0
"""Largest change of that angle from one place to the next."""
_PLACE_S, _PLACE_SPREAD = 0.45, 0.5
"""Mean duration of a rest within a look away, and its standard deviation / mean. A speaker's rests
last 0.19 s (median of Dembinsky et al. 2024), which sounds hectic on servos."""
_MOVES = 1.0
"""Motion of another body that ends a look away: translation, looming and onset of eq 1."""

_HALF_WIDE_M, _HALF_HIGH_M = 0.085, 0.125
"""Half axes of the oval of a face, a little larger than an adult's."""

NOD = "listening_nod"
"""Track of a listener."""
_SIGN_S = 0.7
"""Their length, in which no other one begins."""
_INDIVIDUAL = 0.5
"""Standard deviation of the logarithm of a head's own rate of nods."""
_LONG_TURN_S, _STARTS_AVERTED = 3.0, 0.9
"""Shortest planned turn that begins averted; share of the long turns that do."""
_START_AWAY_S, _START_AWAY_SD_S = 1.2, 0.25
"""Time into a turn until the gaze returns to the face."""
_YIELD_S, _YIELD_SD_S = 2.3, 0.5
"""Time before the planned end at which the gaze is on the face again."""
_YIELD_SHARE = 0.4
"""Largest share of a turn for which the gaze is on the face again before its end."""
_UNSURE_RATIO = 0.2
"""Share of the remaining time by which the gaze returns earlier if the end is quite uncertain."""
_LATE_S = 1.5
"""Time after the planned end for which the gaze still waits on the face."""
_ADDRESSEE = 0.9
"""Share of a speaker's looks at several people that the addressee gets: people's .77, and the time
that the gaze takes to be there and back.
"""


@dataclass(frozen=True)
class AversionParams:
    """Mean times of reported turns on the face and away from it."""

    # fmt: off
    speaking_s: Annotated[tuple[float, float], Bounds(0.1, 60),
        "reported speech: mean time on the face, and away"] = (3.2, 2.2)
    listening_s: Annotated[tuple[float, float], Bounds(0.1, 60),
        "reported listening: mean time on the face, and away"] = (20.0, 0.65)
    # fmt: on


@dataclass(frozen=True)
class ConversationParams:
    """Signs of listening."""

    # fmt: off
    nods_per_min: Annotated[float, Bounds(0, 30), "nods of a listener, mean over heads; 0: none"] = 6.0
    # fmt: on


class ConversationGaze:
    """Semi-Markov process between face and looks away, which follows the turns of a conversation.

    Args:
        looks_away: the law; none: the gaze never leaves a face.
        aversion: mean times of reported turns.
        signs: signs of listening.
        attention: chooses among people.
        rng: draws looks away.
        turn_rng: draws the times of turns, and the head's own rates.

    search: the search of the attention for a person
    """

    def __init__(
        self,
        looks_away: LooksAway,
        aversion: AversionParams,
        signs: ConversationParams,
        attention: Attention,
        rng: np.random.Generator,
        turn_rng: np.random.Generator,
    ) -> None:
        self._attention, self._rng, self._turn_rng = attention, rng, turn_rng
        self.search = attention.search
        self._own = exp(_INDIVIDUAL * float(turn_rng.standard_normal()))
        self._followed = FollowedLook(turn_rng)
        self.retune(looks_away, aversion, signs)
        self._state: TurnState = "idle"
        self.chosen_mode = self._mode = "none"
        self._yields_s = self._ends_s = self._next_sign_s = inf
        self.reset(0.0)

    def retune(
        self, looks_away: LooksAway, aversion: AversionParams, signs: ConversationParams
    ) -> None:
        """Change the parameters, from the next look away and the next state on."""
        self._law, self._signs = looks_away, signs
        (speaks_s, looks_s), (listens_s, glances_s) = aversion.speaking_s, aversion.listening_s
        self._roles = {
            **ROLES,
            "speaking": ROLES["speaking"]._replace(face_s=speaks_s, away_s=looks_s),
            "listening": ROLES["listening"]._replace(face_s=listens_s, away_s=glances_s),
        }

    def reset(self, t_s: float) -> None:
        """Forget the face; the state of the conversation stays."""
        self._face: int | None = None
        self._until_s = self._away_s = t_s
        self._away: Vec3 | None = None
        self._attention.averted = False
        self._faces: tuple[Face, ...] = ()
        self._averts_s: float | None = None
        self._place_until_s = self._kept_until_s = t_s
        self._why = ""
        self._followed.reset()
        self._shifts = self._away_shift = 0

    @property
    def converses(self) -> bool:
        """Return whether a conversation has been reported or chosen, which changes the blinks."""
        return self._state != "idle" or self.chosen_mode != "none"

    def choose_mode(self, mode: str, t_s: float) -> None:
        """Choose the role that applies while no state is reported, one of ``MODES``."""
        self.chosen_mode = mode
        if self._state == "idle":
            self._take_role(mode, t_s)

    def enter(
        self,
        state: TurnState,
        partner: int | None,
        ends_s: float | None,
        confidence: float,
        t_s: float,
    ) -> None:
        """Enter a state, or correct the plan of the present one.

        Args:
            state: The state.
            partner: Id of the partner or addressee, None if unknown.
            ends_s: Planned end of speech, None if unknown.
            confidence: Confidence of the planned end, 0..1.
            t_s: Present time.
        """
        before, self._state = self._state, state
        self._ends_s = inf if ends_s is None else ends_s
        self._yields_s = inf
        shares = {"idle": None, "thinking": _ADDRESSEE, "speaking": _ADDRESSEE}
        self._attention.converse(shares.get(state, 0.0), partner, t_s)
        if state == "idle":
            self._take_role(self.chosen_mode, t_s)
            return
        if state == "speaking":
            self._plan_speech(confidence, before != state, t_s)
        elif state != before:
            self._take_role(state, t_s)
            self._next_sign_s = t_s + self._draw_wait_s() if state == "listening" else inf

    def step(self, t_s: float) -> str:
        """Return to the face before the end of a turn; return a listener's track, "" for none."""
        if t_s >= self._yields_s:
            self._yields_s = inf
            self._return()
            self._averts_s = None
            if self._face is not None:
                self._until_s = max(self._ends_s + _LATE_S, t_s)
        if self._state != "listening" or t_s < self._next_sign_s:
            return ""
        self._next_sign_s = t_s + _SIGN_S + self._draw_wait_s()
        return NOD

    def look(
        self,
        target: Target,
        p_world_head_m: Vec3,
        t_s: float,
        ordered: bool = False,
        rests_until_s: float = -inf,
        percept: Percept | None = None,
    ) -> Target:
        """Return the target itself, or a place next to the face during a look away.

        A place next to a face has kind "away", the id of the face, a centre between them by the
        head's share, and its own shift number, which increases with each place and on
        returning. An unchanged target includes the shifts of earlier looks away in its count.

        A lost face that the gaze is waiting for is not looked away from.

        ordered: a user has chosen the target, from which only a conversation averts the gaze
        rests_until_s: end of the rest on a part of the face, which the gaze does not leave
            sooner; inf while it is moving there
        percept: the newest percept, with the looks of people
        """
        if percept is not None:
            self._faces = percept.faces
            if not self.converses:
                heard = any(one.speaks for one in self._faces)
                self._take_role("listening" if heard else "none", t_s)
        kept = (ordered and not self.converses) or target.is_lost or self._law == "none"
        face = target.id if target.kind == "face" and not kept else None
        if face != self._face:
            before, self._face = self._face, face
            if face is None or t_s >= self._kept_until_s:
                self._away_s = t_s
                # An exponential time goes on from one face to the next.
                keeps = self._away is None and before is not None and self._role.face_sd_s is None
                self._return()
                if face is not None and self._averts_s is None:
                    until_s = self._until_s if keeps else t_s + self._draw_face_s()
                    self._until_s = max(until_s, t_s + _SHORTEST_S)
        if face is None:
            return self._count(target)
        if self._away is not None and self._is_disturbed(target):
            self._until_s = t_s
        leaves = self._away is not None or t_s >= rests_until_s or self._averts_s is not None
        if t_s >= self._until_s and leaves:
            self._turn(target, p_world_head_m, t_s)
        elif percept is not None:
            self._follow_look(target, percept, p_world_head_m, t_s)
        if self._away is None:
            return self._count(target)
        self._away_s = t_s
        centre = _centre_of_target(target)
        if not self._why and (
            t_s >= self._place_until_s or _is_on_face(self._away, centre, p_world_head_m)
        ):  # also if the person has moved into the look away
            way = self._way + radians(_WANDERS_DEG) * float(self._rng.uniform(-1.0, 1.0))
            self._go_towards(way, target, p_world_head_m, t_s)
        return self._away_target(target, self._away, t_s)

    def _count(self, target: Target) -> Target:
        return replace(target, shift=target.shift + self._shifts) if self._shifts else target

    def _is_disturbed(self, target: Target) -> bool:
        """Return whether another body moves so much that it ends a look away."""
        return any(
            one.id != target.id
            and one.kind != "hand"
            and one.translation + one.looming + one.onset > _MOVES
            for one in target.saliences
        )

    def _follow_look(self, target: Target, percept: Percept, p_eye: Vec3, t_s: float) -> None:
        """Look where the person has turned to look."""
        followed = self._followed.step(percept, target.id, p_eye)
        if followed is None or self._away is not None or self._averts_s is not None:
            return
        self._why = f"following the look of face {target.id}"
        self._go_to(target, followed.p_world_m)
        self._until_s = t_s + followed.seconds

    @property
    def _role(self) -> Role:
        return self._roles[self._mode]

    def _take_role(
        self, mode: str, t_s: float, averts: bool = False, away_s: float | None = None
    ) -> None:
        """Take a role, whose looks away begin anew.

        A change returns the gaze to the face. Thinking averts it immediately, as in people.

        mode: a chosen mode or a reported state
        t_s: present time
        averts: the gaze is averted now, without waiting for the end of a rest on the face; a look
            away in progress continues
        away_s: duration of that look away; None: as drawn from the role's distribution
        """
        role = _ROLE_OF.get(mode, mode)
        if role == self._mode and not averts:
            return
        self._mode, self._averts_s = role, None
        averts = averts or role == "thinking"
        if averts:
            duration_s = self._draw_away_s() if away_s is None else away_s
            if self._away is None:
                self._averts_s, self._until_s = duration_s, t_s
            else:
                self._until_s = self._kept_until_s = t_s + duration_s
                self._why, self._way = "", radians(self._draw_direction_deg())
            return
        self._return()
        if self._face is not None:
            # The look began in an earlier turn: both together are no stare.
            longest_s = max(t_s, self._away_s + _LONGEST_S)
            self._until_s = min(t_s + self._draw_face_s(), longest_s)

    def _turn(self, target: Target, p_world_head_m: Vec3, t_s: float) -> None:
        """Switch between face and look away when the drawn duration is over."""
        if self._away is not None:
            self._return()
            self._until_s = t_s + self._draw_face_s()
            return
        away_s, averts = self._averts_s, self._averts_s is not None
        self._averts_s = None
        self._why = ""
        self._go_towards(radians(self._draw_direction_deg()), target, p_world_head_m, t_s)
        self._until_s = t_s + (self._draw_away_s() if away_s is None else away_s)
        if averts:
            self._kept_until_s = self._until_s

    def _go_towards(self, way: float, target: Target, p_world_head_m: Vec3, t_s: float) -> None:
        """Look past the edge of the face in a direction, 0 right and pi/2 up, at its distance.

        On another person's face the gaze would not be averted: it goes to the other side.
        """
        rel = sub(_centre_of_target(target), p_world_head_m)
        ahead, right, up = _axes_to(rel)
        edge_deg = face_extent_deg(way, norm(rel))
        least_deg = max(_LEAST_DEG, edge_deg + _BESIDE_DEG + _DRIFT_DEG)
        beyond_deg = _SCALE_DEG * float(self._rng.standard_exponential())
        angle = radians(min(max(least_deg, self._role.most_deg), least_deg + beyond_deg))
        others = [sub(one.p_world_m, p_world_head_m) for one in self._faces if one.id != target.id]
        for self._way in (way, pi - way):
            aside = add(scale(right, cos(self._way)), scale(up, sin(self._way)))
            looking = add(scale(ahead, cos(angle)), scale(aside, sin(angle)))
            if all(angle_between(looking, other) > radians(_LEAST_DEG) for other in others):
                break
        self._go_to(target, add(p_world_head_m, scale(looking, norm(rel))))
        rest_s = draw_lognormal(self._rng, _PLACE_S, _PLACE_SPREAD)
        self._place_until_s = t_s + max(rest_s, _SHORTEST_S)

    def _go_to(self, target: Target, place: Vec3) -> None:
        self._away = place
        self._attention.averted = True
        self._shifts += 1
        self._away_shift = target.shift + self._shifts

    def _return(self) -> None:
        self._kept_until_s = -inf
        self._attention.averted = False
        if self._away is not None:
            self._away = None
            self._shifts += 1

    def _away_target(self, target: Target, away: Vec3, t_s: float) -> Target:
        role = "no conversation" if self._mode == "none" else self._mode
        centre = _centre_of_target(target)
        return replace(
            target,
            p_world_m=away,
            v_world_m_s=(0.0, 0.0, 0.0),
            at_s=t_s,
            kind=AWAY,
            top_down=True,
            part=None,
            shift=self._away_shift,
            why=self._why or f"looking away from face {target.id} ({role})",
            centre_world_m=add(centre, scale(sub(away, centre), self._role.head)),
        )

    def _draw_direction_deg(self) -> float:
        """Draw the direction, 0 right and 90 up, uniform within a sector of the role."""
        rng, ways = self._rng, self._role.ways
        draw = float(rng.random())
        aside, up = ways
        spread_deg = float(rng.uniform(-_SPREAD_DEG, _SPREAD_DEG))
        if draw < aside:
            return spread_deg + (0.0 if draw < 0.5 * aside else 180.0)
        return spread_deg + (90.0 if draw < aside + up else 270.0)

    def _draw_face_s(self) -> float:
        mean_s, sd_s, *_ = self._role
        if sd_s is None:
            beyond_s = max(0.0, mean_s - _STAYS_S) * float(self._rng.standard_exponential())
            drawn_s = _STAYS_S + beyond_s
        else:
            drawn_s = self._draw_s(mean_s, sd_s)
        return min(_LONGEST_S, drawn_s)

    def _draw_away_s(self) -> float:
        return self._draw_s(self._role.away_s, self._role.away_sd_s)

    def _draw_s(self, mean_s: float, sd_s: float) -> float:
        """Draw from the log-normal distribution with a given mean and standard deviation."""
        return max(draw_lognormal(self._rng, mean_s, sd_s / mean_s), _SHORTEST_S)

    def _plan_speech(self, confidence: float, begins: bool, t_s: float) -> None:
        """Plan the look away at the beginning of a turn, and the return before its end."""
        left_s = self._ends_s - t_s
        if self._ends_s < inf:
            early_s = max(0.0, self._draw_normal(_YIELD_S, _YIELD_SD_S))
            early_s = min(early_s, _YIELD_SHARE * left_s)
            early_s += (1.0 - confidence) * _UNSURE_RATIO * left_s
            self._yields_s = max(t_s, self._ends_s - early_s)
        if begins:
            averts = left_s >= _LONG_TURN_S and self._turn_rng.random() < _STARTS_AVERTED
            away_s = max(0.3, self._draw_normal(_START_AWAY_S, _START_AWAY_SD_S))
            self._take_role("speaking", t_s, averts, away_s)

    def _draw_wait_s(self) -> float:
        """Draw the time to the next nod by this head's own rate; inf without nods."""
        rate = self._signs.nods_per_min * self._own
        return float(self._turn_rng.exponential(60.0 / rate)) if rate > 0.0 else inf

    def _draw_normal(self, mean_s: float, sd_s: float) -> float:
        return mean_s + sd_s * float(self._turn_rng.standard_normal())


def face_extent_deg(way_rad: float, distance_m: float) -> float:
    """Return the extent of a face from its centre, degrees, in a direction (0 right, pi/2 up)."""
    across, up = cos(way_rad) / _HALF_WIDE_M, sin(way_rad) / _HALF_HIGH_M
    return degrees(atan2(1.0 / hypot(across, up), distance_m))


def _is_on_face(away: Vec3, face: Vec3, p_world_head_m: Vec3) -> bool:
    """Return whether a place is closer to the outline of a face than a look away may be."""
    rel, to_away = sub(face, p_world_head_m), sub(away, p_world_head_m)
    x, y, z = (dot(to_away, axis) for axis in _axes_to(rel))
    edge_deg = face_extent_deg(atan2(z, y), norm(rel))
    return degrees(atan2(hypot(y, z), x)) < edge_deg + _BESIDE_DEG - _DRIFT_DEG


def _axes_to(rel: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return the unit vectors towards a point, to the right of it, and up."""
    ahead = unit(rel)
    right = unit(cross(ahead, (0.0, 0.0, 1.0)))
    return ahead, right, cross(right, ahead)


def _centre_of_target(target: Target) -> Vec3:
    return target.p_world_m if target.centre_world_m is None else target.centre_world_m
