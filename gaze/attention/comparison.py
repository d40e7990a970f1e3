"""Comparison of one decision of attention, and the resulting target with its reason."""

from collections.abc import Callable
from math import inf
from typing import NamedTuple

from gazerig.gaze.attention.bottom_up import SalienceRow
from gazerig.gaze.attention.top_down import RuleTarget
from gazerig.gaze.types import Bodies, Salience, Target, body_name, vec

NO_BODY = -1
"""Id of a target that is a point and not a body."""

_LISTED = 4


class TargetComparison(NamedTuple):
    """Amounts of one decision.

    motion:   returns the terms of one of the n bodies
    rule, habituation, total: (n + 1,), the bodies, then the point that a rule may name; the rule's
        constant, the factor of habituation and of faces that look elsewhere, and the compared
        amount, -inf without a target
    best: row of the largest total
    plan: choice of the action planner and its reason, "" without one
    """

    bodies: Bodies
    motion: Callable[[int], SalienceRow]
    rule_target: RuleTarget | None
    rule: list[float]
    habituation: list[float]
    total: list[float]
    best: int
    plan: str = ""

    @property
    def point_kind(self) -> str:
        """Return the kind of the rule's point as a target."""
        return self.rule_target.point_kind if self.rule_target is not None else ""

    def target(self, row: int, captured_s: float) -> Target:
        """Return the target of a row, with its reason."""
        saliences = self._strongest(row)
        first, rule_target = saliences[0], self.rule_target
        moving = first.translation + first.looming + first.rotation + first.onset
        by_rule = rule_target is not None and first.rule > 0.0 and first.rule >= moving
        name = body_name(first.kind, first.id)
        if rule_target is not None and by_rule:
            why = f"{name}: rule {rule_target.behaviour} {first.rule:.2f}"
        else:
            why = f"{name}: {_terms(first)}"
        if (
            rule_target is not None
            and rule_target.point_world_m is not None
            and row == len(self.bodies)
        ):
            p, v = rule_target.point_world_m, rule_target.point_world_m_s
        else:
            p, v = vec(self.bodies.p_world_m[row]), vec(self.bodies.v_world_m_s[row])
        # The head's amplitude follows from the unfactored amount: habituation does not turn the
        # head.
        amount = max(first.rule, moving)
        return Target(
            p, v, captured_s, first.kind, first.id, amount, by_rule, None, 0, why,
            plan=self.plan, saliences=saliences,
        )  # fmt: skip

    def _strongest(self, row: int) -> tuple[Salience, ...]:
        """Return the saliences of a row and of the highest others, term by term."""
        total = self.total
        there = [each for each, one in enumerate(total) if one > -inf]
        rows = sorted(there, key=lambda each: -total[each]) if len(there) > 1 else there
        others = [other for other in rows[:_LISTED] if other != row]
        return tuple([self._salience(each) for each in (row, *others[: _LISTED - 1])])

    def _salience(self, row: int) -> Salience:
        """Return the salience of one row, term by term."""
        rule, habituation, total = self.rule[row], self.habituation[row], self.total[row]
        if row == len(self.bodies):
            kind = self.point_kind
            return Salience(NO_BODY, kind, 0.0, 0.0, 0.0, 0.0, rule, habituation, total)
        name, kind = self.bodies.ids[row], self.bodies.kinds[row]
        translation, looming, rotation, onset, _ = self.motion(row)
        return Salience(name, kind, translation, looming, rotation, onset, rule, habituation, total)


def _terms(salience: Salience) -> str:
    """Return the largest term and all that are at least a tenth of it, as text."""
    terms = {
        "translation": salience.translation,
        "looming": salience.looming,
        "rotation": salience.rotation,
        "onset": salience.onset,
    }
    most = max(terms.values())
    return " + ".join(f"{name} {a:.2f}" for name, a in terms.items() if a >= 0.1 * most)
