"""Observers of every tick; a failing observer does not end the run."""

from collections.abc import Callable

from gazerig.robot.loop.tick import Tick


class Observers:
    """The functions called with every tick; a function that raises is removed.

    Args:
        report: Receives one line about each removed function.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._observers: tuple[tuple[str, Callable[[Tick], object]], ...] = ()

    def add(self, name: str, update: Callable[[Tick], object]) -> None:
        """Add a function under a name for messages."""
        self._observers = (*self._observers, (name, update))

    def update(self, tick: Tick) -> None:
        """Update all observers with a tick; called by the loop."""
        for observer in self._observers:
            try:
                observer[1](tick)
            except Exception as error:
                self._observers = tuple([one for one in self._observers if one is not observer])
                self._report(failure_text(observer[0], error))


def failure_text(name: str, error: Exception) -> str:
    """Return a message that the run continues without a failed observer."""
    what = " ".join(str(error).split())
    why = f"{type(error).__name__}: {what}" if what else type(error).__name__
    return f"{name} failed ({why}); the rig continues without it"
