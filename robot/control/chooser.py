"""Choice of the gaze target by the rig's own attention or by a rule of another package.

A rule runs in addition to the rig's own attention. The rig's attention is always updated, so
that it can immediately replace a rule that fails or is too slow.
"""

from collections.abc import Callable, Sequence
from math import dist, isfinite
from typing import Any, Protocol

from gazerig.drivers.process.bounded_call import BoundedCall
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import GazeState, Percept, Target, Vec3

LONGEST_S = 0.001
"""Time for a rule in a tick; after that the loop continues without its answer."""

MOST_OVERRUNS = 5
"""A rule with this number of overruns within ``FORGIVEN_S`` is dropped."""

BLOCKED_S = 0.25
"""A rule whose call has lasted this long is dropped."""

FORGIVEN_S = 1.0
"""Overruns farther apart than this are forgotten."""

FARTHEST_M = 1e6
"""Largest coordinate [m] and speed [m/s] of a target."""

_JUMP_M = 0.1
"""A bare point that moves farther between two answers counts as a new target."""


class TargetChooser(Protocol):
    """A source of gaze targets, such as gaze.attention.Attention.

    Attributes:
        top_down: The available behaviours.
    """

    top_down: TopDown

    def reset(self, t_s: float) -> None:
        """Forget all observations."""
        ...

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target at ``t_s``."""
        ...


class Chooser(Protocol):
    """A rule for the gaze target from a package or a program."""

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target | Vec3 | None:
        """Choose a target; None leaves the choice to the rig's own attention.

        Args:
            percept: Faces and things of the newest frame in the world, None before the first.
            state: Poses of head and eyes.
            t_s: Time of the tick in s.

        Returns:
            A target, or a point x, y, z in the world in m.
        """
        ...


class GuardedChooser:
    """A rule with the rig's own attention as fallback; implements ``TargetChooser``.

    Args:
        rule: The rule.
        own: The rig's attention; it chooses if the rule does not, and after it was dropped.
        label: Name of the rule in messages.
        report: Receives one line when the rule is dropped.
        longest_s: Real time for the rule in s; None in simulated time, without a limit.
    """

    def __init__(
        self,
        rule: Chooser,
        own: TargetChooser,
        label: str,
        report: Callable[[str], None],
        longest_s: float | None = LONGEST_S,
    ) -> None:
        self._rule: Chooser | None = rule
        self._own, self._label, self._report = own, label, report
        self.top_down = own.top_down
        self._call = BoundedCall(label, longest_s)
        self._overruns: list[float] = []
        self._chosen: Target | None = None
        self._identity: tuple[str, int] | None = None
        self._shift = 0
        self._own_shift = 0

    def reset(self, t_s: float) -> None:
        """Return the target of the rule, otherwise that of the rig's own attention."""
        self._own.reset(t_s)
        self._overruns.clear()
        self._chosen, self._identity = None, None
        rule = self._rule
        if rule is not None:
            outcome = self._call(lambda: _reset(rule, t_s))
            if outcome is not None and outcome.error is not None:
                self._drop(f"failed ({outcome.error_text})")

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target of the rule, otherwise that of the rig's own attention."""
        own, rule = self._own.choose(percept, state, t_s), self._rule
        if rule is not None:
            self._call_rule(rule, percept, state, t_s)
        chosen = self._chosen or own
        identity = (chosen.kind, chosen.id)
        if identity != self._identity or own.shift != self._own_shift and chosen is own:
            self._shift += 1
        self._identity, self._own_shift = identity, own.shift
        return chosen._replace(shift=self._shift)

    def _call_rule(
        self, rule: Chooser, percept: Percept | None, state: GazeState, t_s: float
    ) -> None:
        """Call the rule, and keep its choice until its next answer."""
        outcome = self._call(lambda: _answer(rule, percept, state, t_s))
        if outcome is None:  # the computer may be busy: only the rule's run time counts
            if self._call.running_s() > BLOCKED_S:
                self._drop(f"has not answered for {BLOCKED_S:g} s")
            return
        if outcome.error is not None:
            self._drop(f"failed ({outcome.error_text})")
        elif isinstance(outcome.value, str):
            self._drop(f"returned {outcome.value}")
        elif outcome.took_s <= LONGEST_S or not self._overrun(t_s):
            chosen, before = outcome.value, self._chosen
            if chosen is not None and before is not None and chosen.id < 0:
                self._shift += dist(chosen.p_world_m, before.p_world_m) > _JUMP_M
            self._chosen = chosen

    def _overrun(self, t_s: float) -> bool:
        """Count a late answer; return whether the rule is dropped for it."""
        self._overruns = [at_s for at_s in self._overruns if t_s - at_s < FORGIVEN_S]
        self._overruns.append(t_s)
        if len(self._overruns) < MOST_OVERRUNS:
            return False
        self._drop(f"took longer than {LONGEST_S * 1e3:g} ms {MOST_OVERRUNS} times in a second")
        return True

    def close(self) -> None:
        """Stop calling the rule, and end a running call."""
        self._rule, self._chosen = None, None
        self._call.close()

    def _drop(self, why: str) -> None:
        self.close()
        self._report(f"{self._label} {why}: dropped, the rig's own attention chooses")


def _reset(rule: Chooser, t_s: float) -> None:
    """Reset a rule that can be reset."""
    forget = getattr(rule, "reset", None)
    if callable(forget):
        forget(t_s)


def _answer(
    rule: Chooser, percept: Percept | None, state: GazeState, t_s: float
) -> Target | str | None:
    """Return a rule's choice, or a description of its error; the rule's code may block."""
    answer = rule.choose(percept, state, t_s)
    try:
        return to_target(answer, t_s)
    except ValueError as error:
        return str(error)


def to_target(answer: Any, t_s: float) -> Target | None:
    """Convert a rule's answer to a target.

    Raises:
        ValueError: It is neither a target nor a point nor None, or contains a number that is
            not finite; the message describes it.
    """
    if answer is None:
        return None
    if not isinstance(answer, Target):
        point = _vector(answer, "a target or a point x, y, z")
        return Target(
            point, (0.0, 0.0, 0.0), t_s, "point", -1, 1.0, True, None, 0, "a rule's point"
        )
    if not isinstance(answer.kind, str) or not isinstance(answer.id, int):
        raise ValueError("a target whose kind is not text or whose id is not a whole number")
    for number, name in ((answer.salience, "salience"), (answer.at_s, "at_s")):
        if not _finite(number):
            raise ValueError(f"a target with {name} {number!r}")
    centre = answer.centre_world_m
    return answer._replace(
        p_world_m=_vector(answer.p_world_m, "three numbers as p_world_m"),
        v_world_m_s=_vector(answer.v_world_m_s, "three numbers as v_world_m_s"),
        centre_world_m=None
        if centre is None
        else _vector(centre, "three numbers as centre_world_m"),
        saliences=(),
    )


def _vector(value: Any, wanted: str) -> Vec3:
    """Return three finite numbers.

    Raises:
        ValueError: The value is something else.
    """
    listed = value.tolist() if hasattr(value, "tolist") else value
    if not isinstance(listed, Sequence) or isinstance(listed, str) or len(listed) != 3:
        raise ValueError(f"{_describe(value)}, wanted {wanted}")
    if not all(_finite(one) and abs(one) <= FARTHEST_M for one in listed):
        raise ValueError(f"{_describe(value)}: each must be a number within {FARTHEST_M:g}")
    x, y, z = (float(one) for one in listed)
    return (x, y, z)


def _finite(value: Any) -> bool:
    try:
        return isfinite(value)
    except TypeError:
        return False


def _describe(value: Any) -> str:
    return f"{type(value).__name__} {str(value)[:60]!r}"
