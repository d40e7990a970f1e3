"""Trigger of the present rule's track: once, when the gaze reaches the rule's target."""

from math import inf

from gazerig.gaze.attention.top_down import Rule
from gazerig.gaze.types import Target

_REFRACTORY_S = 10.0
"""Shortest time between two tracks of one rule."""


class TrackTrigger:
    """Trigger of the tracks of rules."""

    def __init__(self) -> None:
        self._reached_by: str | None = None
        self._played_s: dict[str, float] = {}

    def step(
        self, behaviour: str, rule: Rule, target: Target, t_s: float,
        named_ids: frozenset[int] = frozenset(),
    ) -> str:  # fmt: skip
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
        ids = named_ids if rule.person is not None else {rule.body_id}
        reached = target.id in ids or target.kind == rule.look_at
        before, self._reached_by = self._reached_by, behaviour if reached else None
        played_s = self._played_s.get(behaviour, -inf)
        if not reached or before == behaviour or t_s < played_s + _REFRACTORY_S:
            return ""
        self._played_s[behaviour] = t_s
        return rule.gesture
