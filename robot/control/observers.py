"""Observers of every tick, none of which can end the run."""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.robot.control.tick import Tick


class _Observer(NamedTuple):
    name: str
    update: Callable[[Tick], object]


class Observers:
    """Functions called with every tick; one that raises is left out from then on.

    Args:
        say: gets one line about each that is left out.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._observers: tuple[_Observer, ...] = ()

    def add(self, name: str, update: Callable[[Tick], object]) -> None:
        """Call one more with every tick, under a name that people know it by."""
        self._observers = (*self._observers, _Observer(name, update))

    def update(self, tick: Tick) -> None:
        """Update all observers with a tick; called by the loop."""
        for observer in self._observers:
            try:
                observer.update(tick)
            except Exception as error:
                self._observers = tuple([one for one in self._observers if one is not observer])
                self._say(left_out(observer.name, error))


def left_out(name: str, error: Exception) -> str:
    """Return a message that the run goes on without a failed observer."""
    what = " ".join(str(error).split())
    kind = type(error).__name__
    return (
        f"{name} failed ({kind}: {what}); the rig runs on without"
        if what
        else (f"{name} failed ({kind}); the rig runs on without")
    )
