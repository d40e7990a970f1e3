"""What people ask for on the page, handed to the rig: orders, tuning, clicks in the picture."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Protocol, cast

from gazerig.drivers.errors import DriverError
from gazerig.gaze.types import Vec3
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    Command,
    Jog,
    LookAt,
    Resume,
    Tune,
    Value,
    from_json,
    signed,
)
from gazerig.robot.model.reply import CommandTaker
from gazerig.robot.remote.request_handler import ParamAccess, SavedParams

_REPLY_S = 1.0
_SAID_EVERY_S = 3.0
_LATER = "next start"
"""Of what a change did, people are told what it did not; the controls show the rest."""


class PathGuard(Protocol):
    """Says which files a person at a browser may name (gazerig.config.confined.Confined)."""

    def file(self, given: str, kind: str = "") -> str:
        """Return a shipped name or a whole path; raise where it may not be named."""
        ...

    def changes(self, changes: Mapping[str, object]) -> None:
        """Raise where a value names a file that may not be named."""
        ...


PAGE = "the page"
"""Who asks, where a browser does not say which one it is."""

Point = Callable[[float, float], Vec3 | None]
"""Place in the picture, 0..1 from the left and from the top -> point in the world."""


class PageRequestHandler:
    """Carries out one request of the page and gives what there is to say about it."""

    def __init__(
        self,
        order: CommandTaker,
        tuning: ParamAccess | None = None,
        point: Point | None = None,
        steer: Callable[[str], str | None] | None = None,
        replay: Callable[[Mapping[str, object]], str | None] | None = None,
        depth: Callable[[bool], None] | None = None,
        refusals: tuple[type[Exception], ...] = (),
        saved: Callable[[Path], None] | None = None,
        confined: PathGuard | None = None,
    ) -> None:
        """Take who obeys.

        tuning, point, steer, replay, depth: None where there is no such thing to ask for
        refusals: what ``tuning`` raises where a value breaks a rule, besides ValueError
        saved: is told each file that was written
        confined: says which files may be named; None: any
        """
        self._order = order
        self._tuning = tuning
        self._point = point
        self._steer = steer
        self._replay = replay
        self._depth = depth
        self._refusals: tuple[type[Exception], ...] = (
            ValueError, DriverError, OSError, *refusals,
        )  # fmt: skip
        self._saved = saved
        self._confined = confined
        self._clock = RealClock()
        self._limited_s = -_SAID_EVERY_S

    def __call__(self, data: Mapping[str, object]) -> str | None:
        """Do what is asked; None where nothing needs to be said, else words or a refusal."""
        try:
            return self._do(data)
        except self._refusals as error:
            return f"refused: {error}"

    def _do(self, data: Mapping[str, object]) -> str | None:
        match data:
            case {"order": _}:
                return self._obey(data)
            case {"tune": dict(asked)}:
                return self._tune(asked)
            case {"pick": {"x": int() | float() as x, "y": int() | float() as y, **rest}}:
                return self._pick(float(x), float(y), str(rest.get("who") or PAGE))
            case {"steer": str(way)} if self._steer is not None:
                return self._steer(way)
            case {"show": {"depth": bool(on)}} if self._depth is not None:
                self._depth(on)
                return None
            case {"replay": dict(asked)} if self._replay is not None:
                return self._replay(asked)
        raise ValueError(f"{', '.join(map(str, data)) or 'nothing'} cannot be asked for here")

    def _obey(self, data: Mapping[str, object]) -> str | None:
        order = from_json(dict(data))
        if isinstance(order, Tune):
            # An order's values count as checked, and only the tuning checks them.
            raise ValueError("parameters are changed by tuning, which knows their rules")
        return self._ordered(order if getattr(order, "who", PAGE) else signed(order, PAGE))

    def _ordered(self, order: Command) -> str | None:
        """Return an order, and return what it cannot do, None where it does all or nobody waits."""
        ticket = self._order(order)
        if ticket is None or not isinstance(order, LookAt | Jog | Resume):
            return None
        reply = ticket.wait(_REPLY_S)
        if reply is None:
            return "the control loop has not taken it up: it hangs, starts or ends"
        if reply.refused:
            return f"refused: {reply.refused}"
        if not reply.limited:
            return None
        # Of somebody who drags a target out of reach one word is enough for a while.
        now_s = self._clock.now_s()
        if now_s - self._limited_s < _SAID_EVERY_S:
            return None
        self._limited_s = now_s
        return reply.words()

    def _pick(self, x: float, y: float, who: str) -> str | None:
        if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
            raise ValueError("a place in the picture is 0 to 1 from the left and from the top")
        point = self._point(x, y) if self._point is not None else None
        if point is None:
            return "refused: there is no camera picture to look into yet"
        return self._ordered(LookAt(point, who))

    def _tune(self, asked: Mapping[str, object]) -> str | None:
        tuning = self._tuning
        if tuning is None:
            raise ValueError("these parameters cannot be changed while the rig runs")
        match asked:
            case {"set": dict(changes)}:
                if self._confined is not None:
                    self._confined.changes(changes)
                notes = tuning.set(cast(Mapping[str, Value], _frozen(changes)))
                return _lines(note for note in notes if _LATER in str(note))
            case {"save": str() | None as path}:
                return self._save(tuning, path)
            case {"revert": True}:
                return _lines(tuning.revert()) or "all is as in the file again"
            case {"differs": True}:
                lines = [f"{c.key}: {c.new} (default {c.old})" for c in tuning.differs()]
                return "\n".join(lines) or "all is as by default"
            case {"character": str(name)}:
                if self._confined is not None and name not in tuning.characters():
                    name = self._confined.file(name, "characters")
                return _lines(tuning.character(name)) or f"the character is {name}"
        raise ValueError("tuning takes set, save, revert, differs or character")

    def _save(self, tuning: ParamAccess, path: str | None) -> str:
        if path and self._confined is not None:
            path = self._confined.file(path)
        file = Path(path).expanduser() if path else None
        if file is not None and not file.is_absolute():
            raise ValueError(f"{path}: give the whole path; the rig has a folder of its own")
        saved: SavedParams = tuning.save(file)
        if self._saved is not None:
            self._saved(saved.path)
        kept = f", what was there is in {saved.backup}" if saved.backup is not None else ""
        return f"saved in {saved.path}{kept}"


def _lines(notes: object) -> str | None:
    """Make one text of what a person should know, None of nothing."""
    if not isinstance(notes, Iterable) or isinstance(notes, str):
        return None
    return "\n".join(map(str, notes)) or None


def _frozen(value: object) -> object:
    """Make tuples of JSON's lists, as the reader of files does."""
    if isinstance(value, list):
        return tuple(map(_frozen, value))
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return value
