"""Top-down attention: the target of the present behaviour (Mitake et al. 3.3.3).

The paper's rules are attack -> attack target, guard -> guard target, wait -> the opponent's face,
each with a constant amount of attention whose value it does not give. Here a rule may select a kind
of body, persons by behaviour (gazerig.gaze.attention.persons), one body by its id, or a place. If
several bodies match, all are targets, nearer ones with more weight. If no person shows the
behaviour that a rule names, it selects all faces.

With an action planner (gazerig.gaze.attention.action_planner) the behaviour follows from the
percept. A user's choice overrides it until they return to the planner (``PLANNED``).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

from gazerig.gaze.attention.action_planner import ACTIONS, ActionPlanner
from gazerig.gaze.attention.persons import TRAITS
from gazerig.gaze.types import Percept, Vec3
from gazerig.params import Bounds

_ID, _PERSON, _POINT = "id", "person", "point"
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
    # fmt: on

    def __post_init__(self) -> None:
        """Check that the fields fit each other.

        Raises:
            ValueError: an id is not a number; a person's trait is unknown; a point has no position,
                or a position is given for another kind.
        """
        prefix, word = self._words
        known = {_ID: word.isdecimal(), _PERSON: word in TRAITS}
        if self.look_at in TRAITS or (":" in self.look_at and not known.get(prefix)):
            traits = ", ".join(f'"{_PERSON}:{trait}"' for trait in TRAITS)
            raise ValueError(
                f'look_at {self.look_at!r}: write a kind of body, one by its id, e.g. "id:7", or persons: {traits}'
            )
        if (self.look_at == _POINT) != (self.point_world_m is not None):
            raise ValueError("look_at: point and point_world_m go together; give both or neither")

    @property
    def person(self) -> str | None:
        """Return the trait of the persons that it names, None without one."""
        prefix, trait = self._words
        return trait if prefix == _PERSON else None

    @property
    def kind(self) -> str:
        """Return the kind of body it names."""
        return "face" if self.person is not None else self.look_at

    @property
    def body_id(self) -> int | None:
        """Return the id of the single body that it names, None without one."""
        prefix, number = self._words
        return int(number) if prefix == _ID else None

    @property
    def _words(self) -> tuple[str, str]:
        prefix, _, word = self.look_at.partition(":")
        return prefix, word


def _shipped_rules() -> dict[str, Rule]:
    return {
        "wait": Rule("face", 0.5),
        "guard": Rule(GUARD_TARGET, 0.8),
        "attack": Rule(ATTACK_TARGET, 1.4),
    }


@dataclass(frozen=True)
class TopDownParams:
    """The rule set and the initial behaviour."""

    # fmt: off
    behaviour: Annotated[str, "name of the behaviour that is active at the start"] = "wait"
    rules: Annotated[Mapping[str, Rule], "behaviour -> target and its salience"] = field(default_factory=_shipped_rules)
    planner: Annotated[bool, "select the behaviours wait, guard and attack from the percept, as in a boxing match"] = False
    # fmt: on

    def __post_init__(self) -> None:
        """Check the start behaviour and those of the planner.

        Raises:
            ValueError: a behaviour has no rule.
        """
        wanted = (self.behaviour, *ACTIONS) if self.planner else (self.behaviour,)
        for behaviour in wanted:
            if behaviour not in self.rules:
                known = ", ".join(sorted(self.rules))
                raise ValueError(f"behaviour {behaviour!r} has no rule; rules: {known}")


class RuleTarget(NamedTuple):
    """Targets of the present rule.

    ids: the selected bodies; none for a place
    salience: the rule's constant
    p_world_m, v_world_m_s: the selected place and its velocity; None for bodies
    kind: kind of the place
    """

    ids: Collection[int]
    salience: float
    p_world_m: Vec3 | None = None
    v_world_m_s: Vec3 = _STILL
    kind: str = _POINT


class TopDown:
    """Top-down attention: the rules, and the present behaviour.

    behaviour: the present one
    startles: whether the head flinches from what flies at the face
    named_ids: the people with the trait in the present rule, if it has one; set by the caller
        before each step
    """

    def __init__(self, params: TopDownParams) -> None:
        self._params = params
        self._planner = ActionPlanner()
        self.behaviour = params.behaviour
        self.startles = False
        self.reset(0.0)

    def retune(self, params: TopDownParams) -> None:
        """Change the rules; the present behaviour stays unless its rule was removed.

        A changed initial behaviour becomes the present one immediately, also when the planner is
        switched off.
        """
        before, self._params = self._params, params
        ends = before.planner and not params.planner and not self._by_user
        if ends or params.behaviour != before.behaviour or self.behaviour not in params.rules:
            self.behaviour = params.behaviour

    @property
    def rule(self) -> Rule:
        """Return the present rule."""
        return self._params.rules[self.behaviour]

    @property
    def behaviours(self) -> tuple[str, ...]:
        """Return the choices: the behaviours in the order of the rules, and the planner."""
        return (*self._params.rules, PLANNED) if self.plans else tuple(self._params.rules)

    @property
    def chosen_behaviour(self) -> str:
        """Return the chosen one of ``behaviours``."""
        return PLANNED if self.plans and not self._by_user else self.behaviour

    @property
    def plans(self) -> bool:
        """Return whether there is an action planner."""
        return self._params.planner

    @property
    def plan_text(self) -> str:
        """Return the plan of the action planner and its reason, "" without a planner."""
        now = self._planner.plan
        return now.text if self.plans and now.action == self.behaviour else ""

    def plan(self, percept: Percept, p_eye: Vec3, t_s: float) -> None:
        """Let the action planner choose the behaviour; once for each new percept.

        If the user has chosen one, the planner only finds its target.
        """
        if not self._by_user:
            self.behaviour = self._planner.step(percept, p_eye, t_s).action
        elif self.behaviour in ACTIONS:  # and not outside the match
            self._planner.step(percept, p_eye, t_s, self.behaviour)

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

    def step(self, seen: Mapping[int, str]) -> RuleTarget | None:
        """Return the rule's targets among the bodies in view, None without any.

        seen: id and kind of the bodies in view
        """
        rule, plan = self.rule, self._planner.plan
        if self.plans and rule.look_at == ATTACK_TARGET and plan.p_world_m is not None:
            return RuleTarget((), rule.salience, plan.p_world_m, plan.v_world_m_s, ATTACK_TARGET)
        if rule.point_world_m is not None:
            return RuleTarget((), rule.salience, rule.point_world_m)
        guarded = self.plans and rule.look_at == GUARD_TARGET
        number = plan.body_id if guarded else rule.body_id
        if number is None:
            ids = [id for id, kind in seen.items() if kind == rule.kind]
        else:
            ids = [number] if number in seen else []
        named = [id for id in ids if id in self.named_ids]
        return RuleTarget(named or ids, rule.salience) if ids else None
