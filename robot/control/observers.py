"""Observers of every tick; a failing observer does not end the run."""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.robot.control.tick import Tick


class _Observer(NamedTuple):
    name: str
    update: Callable[[Tick], object]


class Observers:
    """The functions called with every tick; a function that raises is removed.

    Args:
        say: Receives one line about each removed function.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._observers: tuple[_Observer, ...] = ()

    def add(self, name: str, update: Callable[[Tick], object]) -> None:
        """Add a function under a name for messages."""
        self._observers = (*self._observers, _Observer(name, update))

    def update(self, tick: Tick) -> None:
        """Update all observers with a tick; called by the loop."""
        for observer in self._observers:
            try:
                observer.update(tick)
            except Exception as error:
                self._observers = tuple([one for one in self._observers if one is not observer])
                self._say(failure_text(observer.name, error))


def failure_text(name: str, error: Exception) -> str:
    """Return a message that the run continues without a failed observer."""
    what = " ".join(str(error).split())
    kind = type(error).__name__
    return (
        f"{name} failed ({kind}: {what}); the rig runs on without"
        if what
        else (f"{name} failed ({kind}); the rig runs on without")
    )
