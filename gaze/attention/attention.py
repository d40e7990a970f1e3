"""Competition of bottom-up and top-down attention (Mitake et al. 3.3.4).

The larger amount of attention wins. Two nearly equal amounts would flicker, so the present winner
is kept for a shortest time, and until another is clearly stronger. A permanent winner would cause a
stare, so amounts are multiplied by the factor of habituation (gazerig.gaze.attention.habituation).
Of the bodies that a rule selects, the one with the highest factor keeps the rule's whole constant,
which the paper's comparison needs: so the gaze does not leave a single person by habituation, and
several people share it.
"""

from math import exp, inf, log, sqrt
from operator import mul

import numpy as np

from gazerig.gaze.angles import add, scale, sub
from gazerig.gaze.attention.bottom_up import BottomUp
from gazerig.gaze.attention.comparison import NO_BODY, TargetComparison
from gazerig.gaze.attention.face_memory import FaceMemory
from gazerig.gaze.attention.habituation import NO_STAY, Habituation, Stay
from gazerig.gaze.attention.idle import Idle
from gazerig.gaze.attention.params import AttentionParams
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.attention.reaction import Reaction
from gazerig.gaze.attention.top_down import RuleTarget, TopDown
from gazerig.gaze.field_of_view import FieldOfView, line_of_sight
from gazerig.gaze.types import Bodies, GazeState, Percept, Target, Vec3, vec

_STILL: Vec3 = (0.0, 0.0, 0.0)
_NO_ONE: frozenset[int] = frozenset()
_SPEED_OVER_S = 0.2  # longest interval between two positions for a speed of the head
_LONGEST_EXTRA_S = 6.0  # beyond 15 s on one face a look is a stare
_DECIDED_S = 0.2
"""Time within which a camera may show the target of a new behaviour after the change."""
_TURNS_S = 1.5
"""Time after a change of speaker or addressee in which only they are looked at."""
_URGENT = 3.0
"""Factor of their salience in this time, if a voice agent has reported the change."""


class Attention:
    """Choice of the target, once for each new frame.

    Args:
        params: hysteresis, habituation and reaction time.
        field_of_view: visibility of bodies.
        bottom_up: salience by motion.
        top_down: the rules.
        idle: gaze without a visible target.
        rng: draws reaction times; None: every change of target is immediate.
        stay_rng: draws the additional times of looks at one of several people; None: none.
    """

    def __init__(
        self,
        params: AttentionParams,
        field_of_view: FieldOfView,
        bottom_up: BottomUp,
        top_down: TopDown,
        idle: Idle,
        rng: np.random.Generator | None = None,
        stay_rng: np.random.Generator | None = None,
    ) -> None:
        self._params = params
        self._field_of_view = field_of_view
        self._bottom_up = bottom_up
        self.top_down = top_down
        self._idle = idle
        self._habituation = Habituation(params.habituation)
        self._reaction = Reaction(params.reaction, rng)
        self._memory = FaceMemory()
        self._persons = Persons()
        self._stay_rng = stay_rng
        self.reset(0.0)

    def retune(self, params: AttentionParams) -> None:
        """Change the hysteresis; the present target and all habituation stay."""
        self._params = params
        self._habituation.retune(params.habituation)
        self._reaction.retune(params.reaction)

    def reset(self, t_s: float) -> None:
        """Forget all targets."""
        for model in (self._bottom_up, self.top_down, self._idle, self._habituation):
            model.reset(t_s)
        self._reaction.reset(t_s)
        self._memory.reset()
        self._persons.reset()
        self._gestures: dict[int, float] = {}
        self._seen_s = -inf
        self._scene = 0
        self._target: Target | None = None
        self._shift = 0
        self._since_s = -inf
        self._identity: tuple[str, int] | None = None
        self._place = _STILL
        self._stay = NO_STAY
        self._speakers = _NO_ONE
        self._behaviour = self.top_down.behaviour
        self._changed_s = -inf
        self._eye: tuple[Vec3, float] | None = None
        self._focus: tuple[float, float] | None = None
        self._partner: int | None = None
        self._turned_s = self._reported_s = -inf

    def converse(self, focus: tuple[float, float] | None, partner: int | None, t_s: float) -> None:
        """Let the choice among people follow a conversation.

        Args:
            focus: share of the looks at several people that the partner gets, 0: the share of
                those who speak; and the least salience of faces. None: no conversation.
            partner: id of the partner or addressee, None if unknown.
            t_s: present time.
        """
        if (focus, partner) != (self._focus, self._partner) and focus is not None:
            self._turned_s = self._reported_s = self._changed_s = t_s
        self._focus, self._partner = focus, partner

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target at ``t_s``."""
        stale_s = self._params.stale_ms / 1e3
        fresh = percept is not None and t_s - percept.captured_s <= stale_s
        new = percept is not None and percept.captured_s != self._seen_s
        target = self._target
        if fresh and not new and target is not None and not self._reaction.is_waiting:
            return target  # as decided for this frame
        if percept is not None and fresh and new:
            self._seen_s = percept.captured_s
            self._target = self._decide(percept, state, t_s)
        if fresh:
            self._target = self._reaction.take_due(t_s) or self._target
        else:
            self._target = None
            self._reaction.drop()
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
            if self._identity is not None:
                self._habituation.record_left(place, t_s)
                self._reaction.record_left(*self._identity, t_s)
            self._identity = identity
            self._shift += 1
            self._since_s = t_s
        return target._replace(shift=self._shift)

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
        attended = self._identity[1] if self._identity is not None else -1
        lasts_s = self._params.face_memory_s
        recovery_s = self._params.habituation.rhythm_recovery_s
        self._persons.update(percept, state.p_world_head_m, recovery_s)
        unseen_s = self._persons.may_speak_unseen_s if self._params.speaker_share > 0.0 else -inf
        bodies = self._memory.step(percept.bodies, attended, percept.captured_s, lasts_s, unseen_s)
        speaking = self._persons.speaking
        if self._focus is not None and speaking.difference(self._speakers):
            self._turned_s = t_s
        self._speakers = speaking.union(bodies.ids[len(percept.bodies) :])
        if self.top_down.plans:
            self.top_down.plan(percept, state.p_world_head_m, t_s)
        trait = self.top_down.rule.person
        self.top_down.named_ids = (
            self._persons.ids_with_trait(trait) if trait is not None else _NO_ONE
        )
        ratio = self._params.looks_elsewhere_ratio
        elsewhere = [
            face.id for face in percept.faces if face.looks_at_head is False and not face.speaks
        ]
        worth = [ratio if id in elsewhere else 1.0 for id in bodies.ids]
        made = self._compare(bodies, worth, state, t_s)
        self._record_gestures(made)
        if self._shows_nothing_salient(made):
            self._reaction.drop()
            seen = [row for row in range(len(made.bodies)) if made.total[row] > -inf]
            places = [vec(made.bodies.p_world_m[row]) for row in seen]
            self._idle.record_seen([made.bodies.ids[row] for row in seen], places, t_s)
            return None
        changed = self._behaviour != self.top_down.behaviour
        if changed:
            self._behaviour, self._changed_s = self.top_down.behaviour, t_s
        present = self._target_row(made)
        row = made.best
        if present is not None:
            favoured = made.total[present] * self._params.hysteresis_ratio
            row = present if made.total[row] < favoured else row
        named = made.rule_target is not None and row in made.rule_target.rows
        if named:
            self._draw_stay(made.bodies.ids[row])
        winner = made.target(row, percept.captured_s)
        # A change of behaviour waits neither for a reaction nor for the end of a fixation.
        if row == present or changed or (named and t_s - self._changed_s <= _DECIDED_S):
            self._reaction.drop()
            return winner
        dwelt_s = -inf if present is None else self._since_s + self._params.min_dwell_ms / 1e3
        self._reaction.start_waiting(winner, dwelt_s)
        if present is not None:
            return made.target(present, percept.captured_s)
        return self._target and self._target._replace(plan=made.plan)

    def _draw_stay(self, id: int) -> None:
        """Draw the additional time of a look at another one of several people."""
        if id == self._stay.id:
            return
        par, extra_s = self._params.habituation, 0.0
        if self._stay_rng is not None and par.stay_s > 0.0:
            variance = log(1.0 + par.stay_spread**2)
            deviation = sqrt(variance) * float(self._stay_rng.standard_normal())
            extra_s = min(par.stay_s * exp(deviation - 0.5 * variance), _LONGEST_EXTRA_S)
        self._stay = Stay(id, extra_s)

    def _shows_nothing_salient(self, made: TargetComparison) -> bool:
        """Return whether there are no bodies, or only things of low salience: gaze is idle."""
        best, most = made.best, made.total[made.best]
        if most == -inf or most >= self._params.least_salience:
            return bool(most == -inf)
        return best < len(made.bodies) and made.bodies.kinds[best] != "face"

    def _compare(
        self, bodies: Bodies, worth: list[float], state: GazeState, t_s: float
    ) -> TargetComparison:
        """Return the amounts that the decision compares.

        worth: additional factor 0..1 of each body's salience
        """
        n, eye, rows = len(bodies), state.p_world_head_m, bodies.rows()
        seen = self._field_of_view.are_visible(bodies, rows, state)
        v_eye = self._eye_velocity(eye, t_s)
        motion = self._bottom_up.step(
            rows, eye, t_s, v_eye, self._gaze(state), seen, *self._motion_limits(bodies)
        )
        rule_target = self.top_down.step(rows, seen, eye)
        attended = self._identity[1] if self._identity is not None else -1
        left = self._habituation.step(rows, eye, attended, t_s)
        left = [*map(mul, left, worth)]
        if not self.top_down.counts_every_motion:
            par = self._params
            ratio = par.habituation.rhythm_ratio
            self._persons.weaken_known(left, bodies.ids, ratio, par.sinking_ratio)
        habituation = [*left, 1.0]
        rule = [0.0] * (n + 1)
        amount = [*[terms.total for terms in motion], 0.0]
        point = rule_target is not None and rule_target.point_world_m is not None
        if rule_target is not None and self._focus is not None:
            rule_target = self._urge(rule_target, t_s)
        if rule_target is not None:
            wanted = [n] if point else rule_target.rows
            for row in wanted:
                rule[row] = rule_target.salience
                amount[row] = max(amount[row], rule_target.salience)
            if not point:
                shares = self._rule_shares(rule_target, bodies.ids, worth, attended, t_s)
                for row, one in zip(wanted, shares, strict=True):
                    habituation[row] = one
        total = [
            one * factor if there else -inf
            for one, factor, there in zip(amount, habituation, (*seen, point), strict=True)
        ]
        best = total.index(max(total))
        plan = self.top_down.plan_text
        return TargetComparison(
            bodies, motion.__getitem__, rule_target, rule, habituation, total, best, plan
        )

    def _urge(self, rule_target: RuleTarget, t_s: float) -> RuleTarget:
        """Return the targets of a rule with the salience of faces in a conversation."""
        if self._focus is None or self.top_down.rule.kind != "face":
            return rule_target
        least = self._focus[1] * (_URGENT if t_s - self._reported_s < _TURNS_S else 1.0)
        return rule_target._replace(salience=max(rule_target.salience, least))

    def _favoured(self, ids: list[int], t_s: float) -> tuple[frozenset[int], float]:
        """Return the people who have a share of the looks together, and that share.

        A mouth shows late who speaks, so a partner just reported is favoured above speakers.
        """
        share, partner = self._params.speaker_share, [id for id in ids if id == self._partner]
        found = self._speakers.intersection(ids)
        reported = t_s - self._reported_s < _TURNS_S
        if self._focus is not None and partner and (self._focus[0] > 0.0 or reported or not found):
            return frozenset(partner), self._focus[0] or share
        return found, share

    def _motion_limits(self, bodies: Bodies) -> tuple[list[float], list[float]]:
        """Return the limit of each body's motion, and the share of it that counts."""
        parts, ratio = self._persons.parts, self._params.own_motion_ratio
        usual, of_hands = self._bottom_up.limit(), self._bottom_up.limit(hand=True)
        most, worth = [], []
        for id, kind in zip(bodies.ids, bodies.kinds, strict=True):
            most.append(of_hands if kind == "hand" and id in self._persons.raised else usual)
            worth.append(ratio if id in parts else 1.0)
        return most, worth

    def _record_gestures(self, made: TargetComparison) -> None:
        """Record the motion of each person's own body, which counts in the next decision."""
        ratio, self._gestures = self._params.own_motion_ratio, {}
        if ratio == 0.0 or ratio == 1.0:
            return
        for row, id in enumerate(made.bodies.ids):
            owner = self._persons.parts.get(id)
            if owner is not None:
                motion = made.motion(row)
                moved = (motion.total - motion.onset) * (1.0 / ratio - 1.0)
                self._gestures[owner] = max(self._gestures.get(owner, 0.0), moved)

    def _rule_shares(
        self,
        rule_target: RuleTarget,
        ids: tuple[int, ...],
        worth: list[float],
        attended: int,
        t_s: float,
    ) -> list[float]:
        """Return the factor 0..1 of each body that a rule selects, 1 for the strongest."""
        named = [ids[row] for row in rule_target.rows]
        moved = self._gestures
        mine = [worth[row] * (1.0 + moved.get(ids[row], 0.0)) for row in rule_target.rows]
        weights = [near * one for near, one in zip(rule_target.nearness, mine, strict=True)]
        weights = self._favour_speakers(named, weights, t_s)
        factors = self._habituation.share(named, weights, attended, t_s, self._stay)
        shares = [
            factor * one * (rule_target.stay if id == self._stay.id else 1.0)
            for id, factor, one in zip(named, factors, mine, strict=True)
        ]
        if t_s - self._turned_s < _TURNS_S and (favoured := self._favoured(named, t_s)[0]):
            shares = [one if id in favoured else 0.0 for id, one in zip(named, shares, strict=True)]
        most = max(*shares, 1e-9)
        return [one / most for one in shares]

    def _favour_speakers(self, ids: list[int], weights: list[float], t_s: float) -> list[float]:
        """Return the weights of people, in which those who may speak have their share."""
        speaking, share = self._favoured(ids, t_s)
        spoken = sum(one for id, one in zip(ids, weights, strict=True) if id in speaking)
        mute = sum(weights) - spoken
        if share == 0.0 or spoken <= 0.0 or mute <= 0.0:
            return weights
        ratio = max(1.0, share / (1.0 - share) * mute / spoken)
        return [
            ratio * one if id in speaking else one for id, one in zip(ids, weights, strict=True)
        ]

    def _gaze(self, state: GazeState) -> Vec3:
        """Return the gaze direction of both eyes, of any length, if the salience depends on it."""
        if not self._bottom_up.needs_gaze:
            return _STILL
        return add(line_of_sight(state, left=True), line_of_sight(state, left=False))

    def _eye_velocity(self, p_eye_m: Vec3, t_s: float) -> Vec3:
        """Return the velocity of the eyes by the head's motion since the last decision, m/s."""
        before, self._eye = self._eye, (p_eye_m, t_s)
        if before is None or not 0.0 < t_s - before[1] <= _SPEED_OVER_S:
            return _STILL
        return scale(sub(p_eye_m, before[0]), 1.0 / (t_s - before[1]))

    def _target_row(self, made: TargetComparison) -> int | None:
        """Return the row of the present target, None if it has disappeared."""
        if self._identity is not None and self._identity[1] == NO_BODY:
            there = made.total[-1] > -inf and made.point_kind == self._identity[0]
            return len(made.bodies) if there else None
        if self._identity is None or self._identity[1] not in made.bodies.ids:
            return None
        row = made.bodies.ids.index(self._identity[1])
        return row if made.total[row] > -inf else None
