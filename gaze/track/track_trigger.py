"""Trigger of the present rule's track: once, when the gaze reaches the rule's target."""

from math import inf

from gazerig.gaze.attention.top_down import Rule
from gazerig.gaze.types import Target

_REFRACTORY_S = 10.0
"""Shortest time between two tracks of one rule."""


class TrackTrigger:
    """Trigger of the tracks of rules."""

    def __init__(self) -> None:
        self._named_by: str | None = None
        self._played_s: dict[str, float] = {}

    def step(
        self,
        behaviour: str,
        rule: Rule,
        target: Target,
        t_s: float,
        named_ids: frozenset[int] = frozenset(),
    ) -> str:
        """Return the track to play now, "" for none.

        Args:
            behaviour: present behaviour.
            rule: rule of this behaviour.
            target: gaze target.
            t_s: present time, seconds.
            named_ids: the people with the rule's trait, if it names persons.
        """
        if not rule.gesture:
            return ""
        before = self._named_by
        named = _is_named(rule, target, named_ids)
        self._named_by = behaviour if named else None
        if not named or before == behaviour:
            return ""
        if t_s < self._played_s.get(behaviour, -inf) + _REFRACTORY_S:
            return ""
        self._played_s[behaviour] = t_s
        return rule.gesture


def _is_named(rule: Rule, target: Target, named_ids: frozenset[int]) -> bool:
    """Return whether a target triggers the rule's track."""
    if rule.person is not None:
        return target.id in named_ids
    if rule.body_id is not None:
        return target.id == rule.body_id
    if rule.point_world_m is not None:
        return target.p_world_m == rule.point_world_m
    return target.kind == rule.look_at
