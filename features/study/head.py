"""The head in the room, which shows conditions by changing the parameters of its run."""

from collections.abc import Callable

from gazerig.errors import Error
from gazerig.features.study.session import HeadLost
from gazerig.features.study.study_file import Study
from gazerig.local_head import LocalHead

_HELD_S = 1.0
"""Time without motion after which a head has lost its condition, seconds."""


class HeadPresenter:
    """Shows conditions on a running head.

    Args:
        study: a checked study.
        head: a head with the study's rig.
        now_s: returns the time of the host's clock.
    """

    def __init__(self, study: Study, head: LocalHead, now_s: Callable[[], float]) -> None:
        self._study, self._head, self._now_s = study, head, now_s
        self._condition: str | None = None
        self._moved_s = now_s()

    def show(self, condition: str) -> None:
        """Show a condition from the next tick on.

        Raises:
            HeadLost: it cannot be shown.
        """
        try:
            if changes := self._study.changes(self._condition, condition):
                self._head.set(changes)
        except Error as error:
            raise HeadLost(f"the condition cannot be shown: {error}") from error
        self._condition = condition

    def check(self) -> None:
        """Check that the head moves.

        Raises:
            HeadLost: it was stopped, is held for longer than a moment, or has ended.
        """
        try:
            state = self._head.state
        except Error as error:
            raise HeadLost(str(error)) from error
        now_s = self._now_s()
        if state.stopped:
            raise HeadLost(f"stopped: {state.stopped}")
        if state.level not in ("hold", "torque_off"):
            self._moved_s = now_s
        if now_s - self._moved_s > _HELD_S:
            raise HeadLost(f"the joints are held: {'; '.join(state.reasons[:3])}")
