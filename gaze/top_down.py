"""Top-down attention: what the behaviour in force makes one look at (Mitake et al. 3.3.3).

The paper's rules are attack -> attack target, guard -> guard target, wait -> the
opponent's face, each with a constant amount of attention whose value it does not give.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from gaze.angles import norm, sub
from gaze.types import Percept, Vec3


@dataclass(frozen=True)
class Rule:
    """One behaviour's rule."""

    look_at: str = field(
        metadata={"unit": "", "says": 'kind of body to look at, e.g. "face" or "hand"'}
    )
    pull: float = field(
        metadata={
            "low": 0.0,
            "high": 10.0,
            "unit": "",
            "says": "its constant amount of attention (A_attack, A_guard, A_face)",
        }
    )


def _shipped_rules() -> dict[str, Rule]:
    return {
        "wait": Rule("face", 0.5),
        "guard": Rule("guard_target", 0.8),
        "attack": Rule("attack_target", 0.9),
    }


@dataclass(frozen=True)
class TopDownParams:
    """The rule set and the behaviour in force at the start."""

    behaviour: str = field(
        default="wait", metadata={"unit": "", "says": "behaviour in force at the start"}
    )
    rules: Mapping[str, Rule] = field(
        default_factory=_shipped_rules,
        metadata={"unit": "", "says": "behaviour -> what to look at and with what pull"},
    )
    stay_with_person: float = field(
        default=1.25,
        metadata={
            "low": 1.0,
            "high": 10.0,
            "unit": "",
            "says": "how many times nearer another person must be to take over",
        },
    )

    def __post_init__(self) -> None:
        """Check the start behaviour.

        Raises:
            ValueError: it is not among the rules.
        """
        if self.behaviour not in self.rules:
            known = ", ".join(sorted(self.rules))
            raise ValueError(f"behaviour {self.behaviour!r} has no rule; rules: {known}")


class Wanted(NamedTuple):
    """What the rule in force points at: row of the body, its pull, the rule's name."""

    row: int
    pull: float
    behaviour: str


class TopDown:
    """Applies the rule of the behaviour in force."""

    def __init__(self, params: TopDownParams) -> None:
        """Take the rule set."""
        self._params = params
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Return to the behaviour of the start."""
        self.behaviour = self._params.behaviour
        self._last_id = -1

    def behave(self, behaviour: str) -> None:
        """Set the behaviour in force.

        Raises:
            ValueError: there is no rule for it; the message lists the rules.
        """
        if behaviour not in self._params.rules:
            known = ", ".join(sorted(self._params.rules))
            raise ValueError(f"no rule for behaviour {behaviour!r}; rules: {known}")
        self.behaviour = behaviour

    def step(self, percept: Percept, p_world_eye_m: Vec3) -> Wanted | None:
        """Give the body that the rule points at, or None where there is none.

        Of several bodies of the wanted kind the nearest is taken, which is the largest
        in the picture, but the one looked at before is kept until another is clearly
        nearer.
        """
        rule = self._params.rules[self.behaviour]
        bodies = percept.bodies
        best_row, best_distance = -1, float("inf")
        for row, kind in enumerate(bodies.kinds):
            if kind != rule.look_at:
                continue
            x, y, z = bodies.p_world_m[row].tolist()
            distance = norm(sub((x, y, z), p_world_eye_m))
            if bodies.ids[row] == self._last_id:
                distance /= self._params.stay_with_person
            if distance < best_distance:
                best_row, best_distance = row, distance
        if best_row < 0:
            return None
        self._last_id = bodies.ids[best_row]
        return Wanted(best_row, rule.pull, self.behaviour)
