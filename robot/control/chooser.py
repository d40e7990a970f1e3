"""What chooses where to look: the rig's own attention, or a rule of another package.

A rule is asked beside the rig's own attention, which goes on all the time, so that it can take
over at once from a rule that fails or is too slow.
"""

from collections.abc import Callable, Sequence
from math import dist, isfinite
from typing import Any, Protocol

from gazerig.drivers.process.bounded_call import BoundedCall
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import GazeState, Percept, Target, Vec3

LONGEST_S = 0.001
"""A rule may take so long in a tick; after that the loop goes on without its answer."""

MOST_OVERRUNS = 5
"""A rule that ran for longer so often within ``FORGIVEN_S`` is dropped."""

BLOCKED_S = 0.25
"""A rule that has been running for so long is dropped."""

FORGIVEN_S = 1.0
"""Overruns farther apart than this are forgotten."""

FARTHEST_M = 1e6
"""No target is farther away or faster."""

_JUMP_M = 0.1
"""A bare point that moves farther from one answer to the next is another thing to look at."""


class TargetChooser(Protocol):
    """Chooses what to look at, as gaze.attention.Attention does.

    top_down: the behaviours there are to choose from
    """

    top_down: TopDown

    def reset(self, t_s: float) -> None:
        """Forget everything seen."""
        ...

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target in force at ``t_s``."""
        ...


class Chooser(Protocol):
    """A rule of who is looked at, as a package or a program brings it."""

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target | Vec3 | None:
        """Return what to look at; None: the rig's own attention chooses.

        Args:
            percept: faces and things in the world in the newest frame; None before the first.
            state: where head and eyes are.
            t_s: time of the tick, seconds.

        Returns:
            A target, or a point x, y, z in the world, metres.
        """
        ...


class GuardedChooser:
    """A rule beside the rig's own attention; implements ``TargetChooser``.

    Args:
        rule: what chooses first.
        own: what chooses where the rule does not, and after it was dropped.
        label: the rule as messages name it.
        say: gets one line when the rule is dropped.
        longest_s: the rule may take so long, real seconds; None: in simulated time, any time.
    """

    def __init__(
        self,
        rule: Chooser,
        own: TargetChooser,
        label: str,
        say: Callable[[str], None],
        longest_s: float | None = LONGEST_S,
    ) -> None:
        self._rule: Chooser | None = rule
        self._own, self._label, self._say = own, label, say
        self.top_down = own.top_down
        self._call = BoundedCall(label, longest_s)
        self._overruns: list[float] = []
        self._chosen: Target | None = None
        self._identity: tuple[str, int] | None = None
        self._shift = 0
        self._own_shift = 0

    def reset(self, t_s: float) -> None:
        """Forget everything seen."""
        self._own.reset(t_s)
        self._overruns.clear()
        self._chosen, self._identity = None, None
        rule = self._rule
        if rule is not None:
            outcome = self._call(lambda: _forget(rule, t_s))
            if outcome is not None and outcome.error is not None:
                self._drop(f"failed ({outcome.why})")

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the target of the rule, else that of the rig's own attention."""
        own, rule = self._own.choose(percept, state, t_s), self._rule
        if rule is not None:
            self._ask(rule, percept, state, t_s)
        chosen = self._chosen or own
        identity = (chosen.kind, chosen.id)
        if identity != self._identity or own.shift != self._own_shift and chosen is own:
            self._shift += 1
        self._identity, self._own_shift = identity, own.shift
        return chosen._replace(shift=self._shift)

    def _ask(self, rule: Chooser, percept: Percept | None, state: GazeState, t_s: float) -> None:
        """Ask the rule, and keep what it chose until it answers again."""
        outcome = self._call(lambda: _answer(rule, percept, state, t_s))
        if outcome is None:  # the machine may have been busy: only the rule's own time is blamed
            if self._call.running_s() > BLOCKED_S:
                self._drop(f"has not answered for {BLOCKED_S:g} s")
            return
        if outcome.error is not None:
            self._drop(f"failed ({outcome.why})")
        elif isinstance(outcome.value, str):
            self._drop(f"returned {outcome.value}")
        elif outcome.took_s <= LONGEST_S or not self._overrun(t_s):
            chosen, before = outcome.value, self._chosen
            if chosen is not None and before is not None and chosen.id < 0:
                self._shift += dist(chosen.p_world_m, before.p_world_m) > _JUMP_M
            self._chosen = chosen

    def _overrun(self, t_s: float) -> bool:
        """Count an answer that came late; return whether the rule is dropped for it."""
        self._overruns = [at_s for at_s in self._overruns if t_s - at_s < FORGIVEN_S]
        self._overruns.append(t_s)
        if len(self._overruns) < MOST_OVERRUNS:
            return False
        self._drop(f"took longer than {LONGEST_S * 1e3:g} ms {MOST_OVERRUNS} times in a second")
        return True

    def close(self) -> None:
        """Ask the rule no more, and end it where it is still at work."""
        self._rule, self._chosen = None, None
        self._call.close()

    def _drop(self, why: str) -> None:
        self.close()
        self._say(f"{self._label} {why}: dropped, the rig's own attention chooses")


def _forget(rule: Chooser, t_s: float) -> None:
    """Have a rule forget everything seen, where it can."""
    forget = getattr(rule, "reset", None)
    if callable(forget):
        forget(t_s)


def _answer(
    rule: Chooser, percept: Percept | None, state: GazeState, t_s: float
) -> Target | str | None:
    """Return what a rule chooses, or what is wrong with it; the rule's code may block."""
    answer = rule.choose(percept, state, t_s)
    try:
        return target_of(answer, t_s)
    except ValueError as error:
        return str(error)


def target_of(answer: Any, t_s: float) -> Target | None:
    """Return what a rule answered as a target; a bare point becomes one.

    Raises:
        ValueError: it is neither a target nor a point nor None, or holds what is not finite; the
            message is what it is.
    """
    if answer is None:
        return None
    if not isinstance(answer, Target):
        point = _vec(answer, "a target or a point x, y, z")
        return Target(
            point, (0.0, 0.0, 0.0), t_s, "point", -1, 1.0, True, None, 0, "a rule's point"
        )
    if not isinstance(answer.kind, str) or not isinstance(answer.id, int):
        raise ValueError("a target whose kind is no text or whose id is no whole number")
    for number, name in ((answer.salience, "salience"), (answer.at_s, "at_s")):
        if not _finite(number):
            raise ValueError(f"a target with {name} {number!r}")
    centre = answer.centre_world_m
    return answer._replace(
        p_world_m=_vec(answer.p_world_m, "three numbers as p_world_m"),
        v_world_m_s=_vec(answer.v_world_m_s, "three numbers as v_world_m_s"),
        centre_world_m=None if centre is None else _vec(centre, "three numbers as centre_world_m"),
        saliences=(),
    )


def _vec(value: Any, wanted: str) -> Vec3:
    """Return three finite numbers.

    Raises:
        ValueError: it is something else.
    """
    listed = value.tolist() if hasattr(value, "tolist") else value
    if not isinstance(listed, Sequence) or isinstance(listed, str) or len(listed) != 3:
        raise ValueError(f"{_shown(value)}, wanted {wanted}")
    if not all(_finite(one) and abs(one) <= FARTHEST_M for one in listed):
        raise ValueError(f"{_shown(value)}: each must be a number within {FARTHEST_M:g}")
    x, y, z = (float(one) for one in listed)
    return (x, y, z)


def _finite(value: Any) -> bool:
    try:
        return isfinite(value)
    except TypeError:
        return False


def _shown(value: Any) -> str:
    return f"{type(value).__name__} {str(value)[:60]!r}"
