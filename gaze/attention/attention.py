"""Competition of bottom-up and top-down attention (Mitake et al. 3.3.4).

The larger amount of attention wins. Two nearly equal amounts would flicker, so the present winner
is kept for a shortest time, and until another is clearly stronger. A permanent winner would cause a
stare, so amounts are multiplied by the factor of habituation (gazerig.gaze.attention.habituation).
Of the bodies that a rule selects, the one with the highest factor keeps the rule's whole constant,
which the paper's comparison needs: so the gaze does not leave a single person by habituation, and
several people share it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import dist, inf
from typing import Annotated, Literal, NamedTuple

import numpy as np
from msgspec.structs import replace

from gazerig.gaze.angles import add, norm, scale, sub
from gazerig.gaze.attention.bottom_up import OWN_MOTION, BottomUp
from gazerig.gaze.attention.face_memory import FaceMemory
from gazerig.gaze.attention.finding import Finding, Sought
from gazerig.gaze.attention.habituation import Habituation, HabituationParams
from gazerig.gaze.attention.idle import Idle
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.attention.reaction import Reaction
from gazerig.gaze.attention.top_down import RuleTarget, TopDown
from gazerig.gaze.field_of_view import line_of_sight, visible_bodies
from gazerig.gaze.types import (
    BodyRows,
    GazeState,
    Percept,
    Salience,
    Target,
    Vec3,
    body_name,
)
from gazerig.params import Bounds

STALE_S = 0.4
"""A frame older than this is not used."""
NO_BODY = -1
"""Id of a target that is a point and not a body."""

_STILL: Vec3 = (0.0, 0.0, 0.0)
_NO_ONE: frozenset[int] = frozenset()
_NO_TARGET = ("", NO_BODY)
_LISTED = 3
"""Number of further saliences that a target lists."""
_SPEED_OVER_S = 0.2  # longest interval between two positions for a speed of the head
_DECIDED_S = 0.2
"""Time within which a camera may show the target of a new behaviour after the change."""
_TURNS_S = 2.0
"""Time after a change of speaker or addressee in which only they are looked at."""
_IN_CONVERSATION = 0.8
"""Least salience of faces during a conversation."""
_REACHES_IN = 0.3
"""Onset of a hand that has just come into view, above which the head turns to it at once."""
_AT_ONCE_ABOVE = 0.85
"""Salience of a rule's target, other than a face, to which it turns at once."""
_URGENT = 3.0
"""Factor of their salience in this time, if a voice agent has reported the change."""

_LOOKS_ELSEWHERE = 0.6
"""Share of its salience that a face keeps while the person neither looks at the head nor speaks."""
_LIFELESS = 0.05
"""Share of a face that shows no life: a photo, a statue, a film on a screen."""
_SPEAKERS = 0.88
"""Share of the looks at several people that speaking people get (Vertegaal et al. 2001)."""
_FEW, _FIRST_LOOK_S = 4, 0.65
"""Number of people up to which each new one gets a look at once, and its shortest time."""
_NEARNESS = 0.5
"""Exponent with which the weight of several people decreases with distance."""
_EDGE, _EDGE_S, _EDGE_AGAIN_S = 3.0, 2.0, 20.0
"""Factor of what moves at the edge of the picture, as its person may be outside it; time for which
it holds, and after which it holds again.
"""


@dataclass(frozen=True)
class AttentionParams:
    """Hysteresis of the choice, and the additions to the published comparison."""

    # fmt: off
    hysteresis_ratio: Annotated[float, Bounds(1, 10),
        "another body becomes the target if its salience exceeds the present target's by this factor"] = 1.2
    min_dwell_ms: Annotated[float, Bounds(0, 10000), "shortest time on one target"] = 300.0
    habituation: Annotated[HabituationParams | Literal["none"],
        "habituation to what is looked at, and inhibition of return; none: neither"] = field(default_factory=HabituationParams)
    reaction: Annotated[Literal["people", "none"],
        "people: a change of target takes their reaction time, and they flinch from what flies at the face; none: neither"] = "people"
    social: Annotated[Literal["people", "none"],
        "people: who looks, speaks, gestures or is near counts for more, and faces out of view are remembered; none: all "
        "bodies count for their motion and by the rules alone"] = "people"
    # fmt: on


class _Decision(NamedTuple):
    """Saliences of one decision: those of the bodies, then of a point that the rule names."""

    rows: BodyRows
    saliences: list[Salience]
    rule_target: RuleTarget | None


class Attention:
    """Choice of the target, once for each new frame.

    Args:
        params: hysteresis, and what is added to the published comparison.
        bottom_up: salience by motion.
        top_down: the rules.
        idle: gaze without a visible target.
        rng: draws reaction times.
        stay_rng: draws the additional times of looks at one of several people.

    averted: whether the gaze looks away from the target, which is no look at a person
    """

    def __init__(
        self,
        params: AttentionParams,
        bottom_up: BottomUp,
        top_down: TopDown,
        idle: Idle,
        rng: np.random.Generator,
        stay_rng: np.random.Generator,
    ) -> None:
        self._bottom_up = bottom_up
        self.top_down = top_down
        self._idle = idle
        self._habituation = Habituation(params.habituation, stay_rng)
        self._reaction = Reaction(rng)
        self._memory = FaceMemory()
        self._persons = Persons()
        self.retune(params)
        self.reset(0.0)

    def retune(self, params: AttentionParams) -> None:
        """Change the parameters; the present target and all habituation stay."""
        self._params = params
        self._habituation.params = params.habituation
        self._reaction.immediate = params.reaction == "none"
        self.top_down.startles = params.reaction == "people"
        self._social = params.social == "people"

    def reset(self, t_s: float) -> None:
        """Forget all targets."""
        for model in (
            self._bottom_up,
            self.top_down,
            self._idle,
            self._habituation,
            self._reaction,
        ):
            model.reset(t_s)
        self._memory.reset()
        self._persons.reset()
        self._gestures: dict[int, float] = {}
        self._seen_s = -inf
        self._scene = 0
        self._target: Target | None = None
        self._shift = 0
        self._since_s = -inf
        self._identity = _NO_TARGET
        self._place = _STILL
        self._speakers = self._begun = _NO_ONE
        self._cut_off: tuple[int, ...] = ()
        self._behaviour = self.top_down.behaviour
        self._changed_s = -inf
        self._eye: tuple[Vec3, float] | None = None
        self.averted = False
        self._met: set[int] = set()
        self._share: float | None = None
        self._partner: int | None = None
        self._turned_s = self._reported_s = self._edge_s = -inf

    @property
    def reacts(self) -> bool:
        """Return whether another target waits for its reaction time."""
        return self._reaction.next is not None

    def converse(self, share: float | None, partner: int | None, t_s: float) -> None:
        """Let the choice among people follow a conversation.

        Args:
            share: share of the looks at several people that the partner gets, 0: the share of
                those who speak; None: no conversation.
            partner: id of the partner or addressee, None if unknown.
            t_s: present time.
        """
        if (share, partner) != (self._share, self._partner) and share is not None:
            self._turned_s = self._reported_s = self._changed_s = t_s
        self._share, self._partner = share, None if share is None else partner

    def search(self, sought: Sought, place: Vec3 | None, t_s: float) -> Finding:
        """Return a search for a person with this reach; place: where it was seen last."""
        return Finding(sought, place, self._idle.params, t_s)

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target at ``t_s``."""
        fresh = percept is not None and t_s - percept.captured_s <= STALE_S
        new = percept is not None and percept.captured_s != self._seen_s
        target = self._target
        if fresh and not new and target is not None and self._reaction.next is None:
            return target  # as decided for this frame
        if percept is not None and fresh and new:
            self._seen_s = percept.captured_s
            self._target = self._decide(percept, state, t_s)
        if fresh:
            self._target = self._reaction.take_due(t_s) or self._target
        else:
            self._target = None
            self._reaction.next = None
        if self._target is None:
            return self._count_shift(self._idle.step(t_s, not fresh), t_s)
        if self._target.id >= 0:
            self._idle.remember(self._target)
        self._target = self._count_shift(self._target, t_s)
        return self._target

    def _count_shift(self, target: Target, t_s: float) -> Target:
        """Count a gaze shift whenever the object changes."""
        place, self._place = self._place, target.p_world_m
        identity = (target.kind, target.id)
        if identity == self._identity and target.shift == self._shift:
            return target
        if identity != self._identity:
            if self._identity != _NO_TARGET:
                self._habituation.record_left(place, t_s)
            self._identity = identity
            self._shift += 1
            self._since_s = t_s
        return replace(target, shift=self._shift)

    def _decide(self, percept: Percept, state: GazeState, t_s: float) -> Target | None:
        """Return the present target with its present position, None without one.

        A new winner waits for its reaction time; a present target that has disappeared keeps its
        position until then.
        """
        if percept.scene != self._scene:  # a cut: the people are no longer there
            self._scene = percept.scene
            self._memory.reset()
            self._persons.reset()
            self._idle.forget_places()
        eye, captured_s = state.p_world_head_m, percept.captured_s
        self._persons.update(percept, eye)
        rows, speaking = percept.bodies.rows(), self._persons.speaking
        if self._social:
            lifeless = percept.bodies.lifeless
            rows = self._memory.step(rows, self._identity[1], captured_s, lifeless)
            if not speaking:
                guesses = t_s - self._turned_s > _TURNS_S
                speaking = self._persons.may_speak(rows) if guesses else self._speakers
            if begun := speaking - self._speakers:
                self._turned_s, self._begun = t_s, begun
        self._speakers = speaking
        if self.top_down.plans:
            self.top_down.plan(percept, eye, t_s)
        trait = self.top_down.rule.person
        self.top_down.named_ids = self._persons.ids_with_trait(trait) if trait else _NO_ONE
        made = self._compare(percept, rows, state, t_s)
        total = [one.total for one in made.saliences]
        best = max(range(len(total)), key=total.__getitem__, default=-1)
        if best < 0 or self._is_faint(made.saliences[best]):
            self._reaction.next = None
            seen = zip(rows.ids, rows.p_world_m, total, strict=False)  # without a rule's point
            self._idle.record_seen({id: p for id, p, one in seen if one > -inf}, t_s)
            return None
        changed = self._behaviour != self.top_down.behaviour
        if changed:
            self._behaviour, self._changed_s = self.top_down.behaviour, t_s
        present, row = self._target_row(made), best
        if present is not None:
            favoured = total[present] * self._params.hysteresis_ratio
            row = present if total[best] < favoured else best
        id = made.saliences[row].id
        named = made.rule_target is not None and id in made.rule_target.ids
        if named and (id in self._speakers or not self._speakers):
            self._habituation.start_stay(id)  # a glance at a listener has no additional time
        winner = self._make_target(made, row, captured_s)
        # A change of behaviour waits neither for a reaction nor for the end of a fixation. Nor does
        # a new speaker, whose mouth has moved for longer than a reaction takes.
        decided_s = self._turned_s if id in self._begun else self._changed_s
        if row == present or changed or (named and t_s - decided_s <= _DECIDED_S):
            self._reaction.next = None
            return winner
        dwelt_s = -inf if present is None else self._since_s + self._params.min_dwell_ms / 1e3
        self._reaction.start_waiting(winner, dwelt_s)
        if present is not None:
            return self._make_target(made, present, captured_s)
        return self._target and replace(self._target, plan=winner.plan)

    def _make_target(self, made: _Decision, row: int, captured_s: float) -> Target:
        first, rule_target = made.saliences[row], made.rule_target
        others = [one for i, one in enumerate(made.saliences) if i != row and one.total > -inf]
        others.sort(key=lambda one: -one.total)
        moving = first.translation + first.looming + first.rotation + first.onset
        by_rule = first.rule > 0.0 and first.rule >= moving
        why = f"rule {self.top_down.behaviour} {first.rule:.2f}" if by_rule else _terms(first)
        why = f"{body_name(first.kind, first.id)}: {why}"
        if rule_target is not None and rule_target.p_world_m is not None and first.id == NO_BODY:
            p, v = rule_target.p_world_m, rule_target.v_world_m_s
        else:
            p, v = made.rows.p_world_m[row], made.rows.v_world_m_s[row]
        urgent = (*self._speakers, self._partner, *self._persons.new, *self._cut_off)
        at_once = by_rule and first.rule > _AT_ONCE_ABOVE and first.kind != "face"
        reaches_in = first.kind == "hand" and first.onset > _REACHES_IN
        # The head's amplitude follows from the unfactored amount: habituation does not turn the
        # head.
        return Target(
            p, v, captured_s, first.kind, first.id, max(first.rule, moving), by_rule, None, 0, why,
            plan=self.top_down.plan_text, saliences=(first, *others[:_LISTED]),
            urgent=self._social and (at_once or reaches_in or first.id in urgent),
        )  # fmt: skip

    def _is_faint(self, best: Salience) -> bool:
        """Return whether nothing is visible but things that get only glances: gaze is idle."""
        faint = best.total < self._bottom_up.least_salience
        return best.total == -inf or (faint and best.kind != "face" and best.id != NO_BODY)

    def _compare(self, percept: Percept, rows: BodyRows, state: GazeState, t_s: float) -> _Decision:
        eye, attended = state.p_world_head_m, self._identity[1]
        self._met = {attended, *self._met}.intersection(rows.ids)
        seen = visible_bodies(rows, state)
        gaze = add(line_of_sight(state, left=True), line_of_sight(state, left=False))
        v_eye = self._eye_velocity(eye, t_s)
        raised, own = self._persons.raised, self._persons.parts if self._social else {}
        head_rad_s = norm(state.head_rate_rad_s)
        settles = self._social and bool(self._persons.new)
        motion = self._bottom_up.step(
            rows, eye, t_s, v_eye, gaze, seen, raised, own, head_rad_s, settles
        )
        worth = dict.fromkeys(rows.ids, 1.0)
        for face in percept.faces if self._social else ():
            if face.looks_at_head is False and not face.speaks:
                worth[face.id] = _LOOKS_ELSEWHERE
        lifeless = percept.bodies.lifeless if self._social else ()
        worth |= dict.fromkeys(lifeless, _LIFELESS)
        self._met.update(lifeless)  # the first look at a person is for the living
        unseen = rows.ids[len(percept.bodies) :]
        self._cut_off = (*percept.bodies.cut_off, *unseen)
        edge = set(percept.bodies.cut_off).difference(own) if self._social else _NO_ONE
        since_s = t_s - self._edge_s
        if attended in edge and since_s > _EDGE_AGAIN_S:
            self._edge_s = t_s
        if not _EDGE_S < since_s < _EDGE_AGAIN_S:
            worth |= dict.fromkeys(edge, _EDGE)
        for id in unseen:
            if self._speakers and id not in self._speakers:
                worth[id] = 0.0  # the head does not turn from a speaker to a listener out of view
        left = self._habituation.step(rows, eye, attended, t_s)
        factors = {id: one * worth[id] for id, one in left.items()}
        if not self.top_down.plans:  # fists must be watched
            self._persons.weaken_known(factors, self._params.habituation != "none", self._social)
        rule_target, rule = self.top_down.step(seen), 0.0
        shares: dict[int, float] = {}
        point = []
        if rule_target is not None:
            rule = rule_target.salience
            if self._share is not None and self.top_down.rule.kind == "face":
                urgent = _URGENT if t_s - self._reported_s < _TURNS_S else 1.0
                rule = max(rule, _IN_CONVERSATION * urgent)
            if rule_target.p_world_m is not None:
                point = [Salience(NO_BODY, rule_target.kind, rule=rule, total=rule)]
            else:
                away = {
                    id: max(dist(p, eye), 1e-3)
                    for id, p in zip(rows.ids, rows.p_world_m, strict=True)
                    if id in rule_target.ids
                }
                shares = self._rule_shares(away, worth, t_s)
        # The motion of a person's own body counts in the next decision.
        self._gestures = {}
        saliences = []
        for one in motion:
            if (owner := own.get(one.id)) is not None:
                moved = (one.total - one.onset) * (1.0 / OWN_MOTION - 1.0)
                self._gestures[owner] = max(self._gestures.get(owner, 0.0), moved)
            factor, wanted = shares.get(one.id, factors[one.id]), 0.0
            if one.id in shares:
                wanted = rule
            total = max(one.total, wanted) * factor if one.id in seen else -inf
            saliences.append(replace(one, rule=wanted, habituation=factor, total=total))
        return _Decision(rows, saliences + point, rule_target)

    def _favoured(self, ids: Iterable[int], t_s: float) -> tuple[frozenset[int], float]:
        """Return the people who have a share of the looks together, and that share.

        A mouth shows late who speaks, so a partner just reported is favoured above speakers.
        """
        share = _SPEAKERS if self._social else 0.0
        found = self._speakers.intersection(ids)
        if t_s - self._turned_s < _TURNS_S:
            found = found & self._begun or found
        partner = frozenset(id for id in ids if id == self._partner)
        reported = t_s - self._reported_s < _TURNS_S
        if partner and (self._share or reported or not found):
            return partner, self._share or share
        return found, share

    def _rule_shares(
        self, away_m: Mapping[int, float], worth: Mapping[int, float], t_s: float
    ) -> dict[int, float]:
        """Return the factor 0..1 of each body that a rule selects, 1 for the strongest.

        away_m: their distances by id
        worth: further factor of each body
        """
        weights = mine = {id: worth[id] * (1.0 + self._gestures.get(id, 0.0)) for id in away_m}
        if self._social:
            nearest = min(away_m.values())
            weights = {id: (nearest / away_m[id]) ** _NEARNESS * one for id, one in mine.items()}
        attended = NO_BODY if self.averted else self._identity[1]
        # Those who may speak have their share.
        favoured, share = self._favoured(mine, t_s)
        spoken = sum(one for id, one in weights.items() if id in favoured)
        mute = sum(weights.values()) - spoken
        if share > 0.0 and spoken > 0.0 and mute > 0.0:
            ratio = max(1.0, share / (1.0 - share) * mute / spoken)
            weights = {id: one * ratio if id in favoured else one for id, one in weights.items()}
        factors = self._habituation.share(weights, attended, t_s)
        shares = {id: factors[id] * one for id, one in mine.items()}
        only = favoured if t_s - self._turned_s < _TURNS_S else _NO_ONE
        if self._social and not favoured and len(mine) <= _FEW:
            only = frozenset(mine) - self._met
            if only and t_s - self._since_s < _FIRST_LOOK_S:
                only |= {attended}
        if only:
            shares = {id: one if id in only else 0.0 for id, one in shares.items()}
        most = max(*shares.values(), 1e-9)
        return {id: one / most for id, one in shares.items()}

    def _eye_velocity(self, p_eye_m: Vec3, t_s: float) -> Vec3:
        """Return the velocity of the eyes by the head's motion since the last decision, m/s."""
        before, self._eye = self._eye, (p_eye_m, t_s)
        if before is None or not 0.0 < t_s - before[1] <= _SPEED_OVER_S:
            return _STILL
        return scale(sub(p_eye_m, before[0]), 1.0 / (t_s - before[1]))

    def _target_row(self, made: _Decision) -> int | None:
        """Return the row of the present target, None if it has disappeared."""
        kind, id = self._identity
        there = (
            row
            for row, one in enumerate(made.saliences)
            if one.id == id and one.total > -inf and (id != NO_BODY or one.kind == kind)
        )
        return next(there, None)


def _terms(salience: Salience) -> str:
    """Return the largest term of motion and all that are at least a tenth of it, as text."""
    names = ("translation", "looming", "rotation", "onset")
    terms = {name: getattr(salience, name) for name in names}
    most = max(terms.values())
    return " + ".join(f"{name} {a:.2f}" for name, a in terms.items() if a >= 0.1 * most)
