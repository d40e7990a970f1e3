"""Top-down attention: the target of the present behaviour (Mitake et al. 3.3.3).

The paper's rules are attack -> attack target, guard -> guard target, wait -> the opponent's face,
each with a constant amount of attention whose value it does not give. Here a rule may select a kind
of body, persons by behaviour (gazerig.gaze.attention.persons), one body by its id, or a place. If
several bodies match, all are targets, nearer ones with more weight. If no person shows the
behaviour that a rule names, it selects all faces.

With an action planner (gazerig.gaze.attention.action_planner) the behaviour follows from the
percept. A user's choice overrides it until they return to the planner (``PLANNED``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import dist
from typing import Annotated, NamedTuple

from gazerig.gaze.attention.action_planner import (
    ACTIONS,
    Action,
    ActionPlanner,
    ActionPlannerParams,
)
from gazerig.gaze.attention.persons import TRAITS
from gazerig.gaze.types import BodyRows, Percept, Vec3
from gazerig.params import Bounds

_BY_ID = "id:"
_PERSON = "person:"
_POINT = "point"
_NO_ONE: frozenset[int] = frozenset()
_STILL: Vec3 = (0.0, 0.0, 0.0)

PLANNED = "planned"
"""Choice in the menu of behaviours that leaves them to the action planner."""

GUARD_TARGET, ATTACK_TARGET = "guard_target", "attack_target"
"""Targets of a rule from the action planner: the approaching fist, and the place to hit."""


@dataclass(frozen=True)
class Rule:
    """Rule of one behaviour."""

    # fmt: off
    look_at: Annotated[str,
        'kind of body to look at, e.g. "face" or "hand"; "person:nearest", "person:waving", "person:looking" (at the head) or '
        '"person:newest" (the last to appear); "id:7" for the body with that id; "point" for the position point_world_m']
    salience: Annotated[float, Bounds(0, 10), "salience of the rule's target (A_attack, A_guard, A_face)"]
    point_world_m: Annotated[tuple[float, float, float] | None, Bounds(-100, 100),
        "position to look at: ahead, left and above of the neck base"] = None
    gesture: Annotated[str, "gesture that is played once when the gaze reaches the rule's target; empty: none"] = ""
    gesture_at: Annotated[str, 
        "kind of body at which it is played instead, e.g. hand; empty: that of look_at"] = ""
    gesture_refractory_s: Annotated[float, Bounds(0, 3600), "shortest time between two gestures of this rule"] = 10.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the fields fit each other.

        Raises:
            ValueError: an id is not a number; a person's trait is unknown; a point has no position,
                or a position is given for another kind.
        """
        self._check_person()
        if self.look_at.startswith(_BY_ID) and not self.look_at[len(_BY_ID) :].isdecimal():
            raise ValueError(f'look_at {self.look_at!r} does not name an id; write e.g. "id:7"')
        if (self.look_at == _POINT) != (self.point_world_m is not None):
            raise ValueError("look_at: point and point_world_m go together; give both or neither")

    def _check_person(self) -> None:
        """Check that a rule names persons by a known trait.

        Raises:
            ValueError: it does not; the message lists the possible words.
        """
        prefix, colon, word = self.look_at.partition(":")
        traits = ", ".join(f'"{_PERSON}{trait}"' for trait in TRAITS)
        if self.look_at in TRAITS:
            raise ValueError(f'look_at {self.look_at!r}: write "{_PERSON}{self.look_at}"')
        if colon and f"{prefix}:" not in (_BY_ID, _PERSON):
            raise ValueError(
                f'look_at {self.look_at!r}: the word before ":" must be "id" or "person"; write e.g. "id:7" '
                f"or one of {traits}"
            )
        if f"{prefix}:" == _PERSON and word not in TRAITS:
            raise ValueError(
                f"look_at {self.look_at!r} does not name a person; write one of {traits}"
            )

    @property
    def person(self) -> str | None:
        """Return the trait of the persons that it names, None without one."""
        named = self.look_at.startswith(_PERSON)
        return self.look_at[len(_PERSON) :] if named else None

    @property
    def kind(self) -> str:
        """Return the kind of body it names."""
        return "face" if self.person is not None else self.look_at

    @property
    def body_id(self) -> int | None:
        """Return the id of the single body that it names, None without one."""
        return int(self.look_at[len(_BY_ID) :]) if self.look_at.startswith(_BY_ID) else None


def _shipped_rules() -> dict[str, Rule]:
    return {
        "wait": Rule("face", 0.5),
        "guard": Rule(GUARD_TARGET, 0.8),
        "attack": Rule(ATTACK_TARGET, 0.9),
    }


@dataclass(frozen=True)
class TopDownParams:
    """The rule set and the initial behaviour."""

    # fmt: off
    behaviour: Annotated[str, "name of the behaviour that is active at the start"] = "wait"
    rules: Annotated[Mapping[str, Rule], "behaviour -> target and its salience"] = field(default_factory=_shipped_rules)
    stay_with_person: Annotated[float, Bounds(1, 10),
        "the person looked at last counts as this many times nearer; larger: the gaze changes less often"] = 1.25
    nearness: Annotated[float, Bounds(0, 4),
        "exponent with which salience decreases with distance if several bodies match a rule; 0: distance has no effect"] = 0.5
    planner: Annotated[ActionPlannerParams, "action planner of a boxing match"] = field(default_factory=ActionPlannerParams)
    # fmt: on

    def __post_init__(self) -> None:
        """Check the start behaviour and those of the planner.

        Raises:
            ValueError: a behaviour has no rule.
        """
        wanted = (self.behaviour, *ACTIONS) if self.planner.enabled else (self.behaviour,)
        for behaviour in wanted:
            if behaviour not in self.rules:
                known = ", ".join(sorted(self.rules))
                raise ValueError(f"behaviour {behaviour!r} has no rule; rules: {known}")
        if PLANNED in self.rules:
            raise ValueError(f"no rule can be called {PLANNED!r}: that name selects the planner")


class RuleTarget(NamedTuple):
    """Targets of the present rule.

    rows:     rows of the selected bodies; none for a place
    nearness: weight of each, 1 for the nearest
    stay:     factor by which the last target is preferred
    point_world_m: the selected place, None for bodies
    salience, behaviour: the rule's constant and name
    point_kind, point_world_m_s: kind of the place, and its velocity
    """

    rows: list[int]
    nearness: list[float]
    stay: float
    point_world_m: Vec3 | None
    salience: float
    behaviour: str
    point_kind: str = _POINT
    point_world_m_s: Vec3 = _STILL


class TopDown:
    """Top-down attention: the rules, and the present behaviour.

    behaviour: the present one
    named_ids: the people with the trait in the present rule, if it has one; set by the caller
        before each step
    """

    def __init__(self, params: TopDownParams) -> None:
        self._params = params
        self._planner = ActionPlanner(params.planner)
        self.behaviour = params.behaviour
        self.reset(0.0)

    def retune(self, params: TopDownParams) -> None:
        """Change the rules; the present behaviour stays unless its rule was removed.

        A changed initial behaviour becomes the present one immediately. The initial behaviour
        also follows a planner that is switched off.
        """
        before, self._params = self._params, params
        self._planner.retune(params.planner)
        ends = before.planner.enabled and not params.planner.enabled and not self._by_user
        if ends or params.behaviour != before.behaviour or self.behaviour not in params.rules:
            self.behaviour = params.behaviour

    @property
    def rule(self) -> Rule:
        """Return the present rule."""
        return self._params.rules[self.behaviour]

    @property
    def behaviours(self) -> tuple[str, ...]:
        """Return the choices: the behaviours in the order of the rules, and the planner."""
        rules = tuple(self._params.rules)
        return (*rules, PLANNED) if self._params.planner.enabled else rules

    @property
    def chosen_behaviour(self) -> str:
        """Return the chosen one of ``behaviours``."""
        return PLANNED if self.plans and not self._by_user else self.behaviour

    @property
    def plans(self) -> bool:
        """Return whether there is an action planner."""
        return self._params.planner.enabled

    @property
    def counts_every_motion(self) -> bool:
        """Return whether repeated and sinking motion counts in full, as that of fists does."""
        return self.plans and self._params.planner.counts_every_motion

    @property
    def plan_text(self) -> str:
        """Return the plan of the action planner and its reason, "" without a planner."""
        now = self._planner.plan
        return now.text if self.plans and now.action == self.behaviour else ""

    def plan(self, percept: Percept, p_eye: Vec3, t_s: float) -> None:
        """Let the action planner choose the behaviour; once for each new percept.

        If the user has chosen one, the planner only finds its target.
        """
        asked: Action | None = None
        if self._by_user:
            asked = next((one for one in ACTIONS if one == self.behaviour), None)
            if asked is None:  # a behaviour outside the match
                return
        self.behaviour = self._planner.step(percept, p_eye, t_s, asked).action

    def reset(self, t_s: float) -> None:
        """Return to the initial behaviour, which the planner may change."""
        self.behaviour = self._params.behaviour
        self._by_user = False
        self._planner.reset()
        self.named_ids = _NO_ONE

    def behave(self, behaviour: str) -> None:
        """Set the present behaviour, or leave it to the planner again.

        Raises:
            ValueError: it has no rule; the message lists the behaviours.
        """
        if behaviour not in self.behaviours:
            known = ", ".join(sorted(self.behaviours))
            raise ValueError(f"no rule for behaviour {behaviour!r}; rules: {known}")
        self._by_user = behaviour != PLANNED
        if self._by_user:
            self.behaviour = behaviour

    def step(
        self,
        bodies: BodyRows,
        seen: list[bool],
        p_world_eye_m: Vec3,
    ) -> RuleTarget | None:
        """Return the rule's targets among the bodies in view, None without any.

        seen: which bodies are in view
        """
        rule = self._params.rules[self.behaviour]
        if self.plans and (planned := self._plan_target(rule, bodies.ids, seen)):
            return planned
        if rule.point_world_m is not None:
            point = rule.point_world_m
            return RuleTarget([], [], self._stay_factor, point, rule.salience, self.behaviour)
        named: Sequence[object] = bodies.kinds if rule.body_id is None else bodies.ids
        wanted = rule.kind if rule.body_id is None else rule.body_id
        rows = [i for i, one in enumerate(named) if one == wanted and seen[i]]
        if not rows:
            return None
        if self.named_ids:
            rows = [i for i in rows if bodies.ids[i] in self.named_ids] or rows
        near = [1.0]
        if len(rows) > 1:
            away = [max(dist(bodies.p_world_m[i], p_world_eye_m), 1e-3) for i in rows]
            nearest, power = min(away), self._params.nearness
            near = [(nearest / one) ** power for one in away]
        return RuleTarget(rows, near, self._stay_factor, None, rule.salience, self.behaviour)

    def _plan_target(self, rule: Rule, ids: Sequence[int], seen: list[bool]) -> RuleTarget | None:
        """Return the plan's target, if the rule uses the planner's target."""
        plan = self._planner.plan
        if rule.look_at == GUARD_TARGET and plan.body_id in ids:
            row = ids.index(plan.body_id)
            if seen[row]:
                return RuleTarget(
                    [row], [1.0], self._stay_factor, None, rule.salience, self.behaviour
                )
        if rule.look_at == ATTACK_TARGET and plan.p_world_m is not None:
            return RuleTarget(
                [], [], self._stay_factor, plan.p_world_m, rule.salience, self.behaviour, ATTACK_TARGET,
                plan.v_world_m_s,
            )  # fmt: skip
        return None

    @property
    def _stay_factor(self) -> float:
        """Return the factor by which the present person is preferred, as if nearer."""
        return float(self._params.stay_with_person**self._params.nearness)
