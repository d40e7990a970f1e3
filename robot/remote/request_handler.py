"""What a running rig answers to another program: requests and answers as plain JSON values.

{"do": "set", "changes": {"loop.rate_hz": 100.0}}  ->  {"ok": {"notes": []}}
{"do": "set", "changes": {"loop.rate_hz": 1e9}}    ->  {"refused": "... is above 1000 ..."}
"""

import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import Protocol

from gazerig.drivers.errors import DriverError
from gazerig.robot.control.feedback_basis import reckoned_joints
from gazerig.robot.control.loop import Tick
from gazerig.robot.control.tick_text import lead_words, target_name
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Command, Renew, Tune, Value, from_json, signed
from gazerig.robot.model.reply import Ticket

_TAKEN_UP_S = 1.0
"""Within this the loop must have obeyed; a servo that answers late costs it some 50 ms."""
_WORDS = 20
"""How many of the last things said are kept."""

_HANGS = (
    f"the control loop has not taken it up within {_TAKEN_UP_S:g} s: it hangs, "
    "starts or ends; what moves is stopped by the emergency stop"
)

REQUESTS = (
    'status', 'menus', 'knobs, "prefix"', 'get, "prefix"', 'set, "changes": {key: value}',
    'unsaved', 'differs', 'save, "path": absolute path or null', 'revert', 'characters',
    'character, "name"', 'order, "order": an order as JSON',
)  # fmt: skip
"""All that can be asked for, in words."""


class DescribedParam(Protocol):
    """A parameter that can be tuned, with its rule; a NamedTuple."""

    @property
    def key(self) -> str:
        """Return the dotted key."""
        ...

    def _asdict(self) -> dict[str, object]: ...


class ChangedParam(Protocol):
    """A value that differs from another."""

    @property
    def key(self) -> str:
        """Return the dotted key."""
        ...

    @property
    def old(self) -> object:
        """Return what it is compared with."""
        ...

    @property
    def new(self) -> object:
        """Return what is in force."""
        ...


class SavedParams(Protocol):
    """What was written where."""

    @property
    def path(self) -> Path:
        """Return the file."""
        ...

    @property
    def backup(self) -> Path | None:
        """Return where the old file was kept, None where nothing was written."""
        ...

    @property
    def changes(self) -> Sequence[ChangedParam]:
        """Return what was written."""
        ...


class ParamAccess(Protocol):
    """The parameters of a running rig."""

    @property
    def version(self) -> int:
        """Count the changes."""
        ...

    def knobs(self) -> Iterable[DescribedParam]:
        """Return all parameters."""
        ...

    def get(self, prefix: str) -> Mapping[str, Value]:
        """Return the values in force whose keys begin so."""
        ...

    def set(self, changes: Mapping[str, Value]) -> Iterable[str]:
        """Put values in force from the next tick on; give what a person should know."""
        ...

    def unsaved(self) -> Iterable[ChangedParam]:
        """Return what is in force and not in the file."""
        ...

    def differs(self) -> Iterable[ChangedParam]:
        """Return what differs from the defaults."""
        ...

    def save(self, path: Path | None = None) -> SavedParams:
        """Write what is in force."""
        ...

    def revert(self) -> object:
        """Put in force what the file says."""
        ...

    def characters(self) -> Sequence[str]:
        """Return the characters there are."""
        ...

    def character(self, name: str) -> object:
        """Lay another character over the rig."""
        ...


class Commandable(Protocol):
    """A robot that takes orders, as gazerig.robot.control.loop.Robot does."""

    def order(self, order: Command) -> Ticket | None:
        """Ask for something from the next tick on; raises ValueError with the rule."""
        ...

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return what there is to ask for."""
        ...


class Pulse:
    """The newest tick, and whether the loop lives."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._newest: Tick | None = None
        self._ticks = 0
        self._said: deque[str] = deque(maxlen=_WORDS)
        self._never = threading.Event()

    def note(self, tick: Tick) -> None:
        """Leave the newest tick; called by the loop."""
        self._newest = tick
        self._ticks += 1
        if tick.events:
            self._said.extend(tick.events)

    def taken_up(self, within_s: float = _TAKEN_UP_S, ticks: int = 2) -> bool:
        """Wait until all orders given before are obeyed; tell whether that came to pass.

        ticks: to wait for; the one under way may have looked for orders already, the next
            one has not
        """
        wanted = self._ticks + ticks
        waits = int(within_s / 0.002)
        while self._ticks < wanted and waits > 0:
            self._never.wait(0.002)
            waits -= 1
        return self._ticks >= wanted

    def words(self) -> dict[str, object]:
        """Return the newest tick as plain values: degrees, seconds, words."""
        tick = self._newest
        if tick is None:
            return {"ticks": 0, "stopped": "", "said": []}
        measured = zip(tick.verdict.joints, tick.joints.position_rad, strict=True)
        return {
            "ticks": self._ticks,
            "t_s": tick.t_s,
            "age_s": self._clock.now_s() - tick.t_s,
            "stopped": tick.stopped,
            "led": tick.led,
            "lead": lead_words(tick),
            "limited": [
                {
                    "axis": one.axis,
                    "asked_deg": round(degrees(one.asked_rad), 2),
                    "done_deg": round(degrees(one.done_rad), 2),
                    "reason": one.reason,
                }
                for one in tick.gaze.limited
            ],
            "level": tick.verdict.level,
            "reasons": list(tick.verdict.reasons),
            "target": target_name(tick.target),
            "why": tick.target.why,
            "phase": tick.gaze.phase,
            "joints_deg": {name: round(degrees(angle), 2) for name, angle in measured},
            "reckoned": list(reckoned_joints(tick)),
            "said": list(self._said),
        }


class RequestHandler:
    """Carries out what another program asks of the running rig."""

    def __init__(
        self,
        robot: Commandable,
        tuning: ParamAccess,
        pulse: Pulse,
        about: Mapping[str, object],
        refusals: tuple[type[Exception], ...] = (),
        saved: Callable[[Path], None] | None = None,
    ) -> None:
        """Take the rig.

        about: what does not change, as {"rig": name, "pid": process}
        refusals: what ``tuning`` raises where a value breaks a rule, besides ValueError
        saved: is told each file that was written
        """
        self._robot = robot
        self._tuning = tuning
        self._pulse = pulse
        self._about = dict(about)
        self._refusals: tuple[type[Exception], ...] = (
            ValueError, DriverError, OSError, *refusals,
        )  # fmt: skip
        self._saved = saved
        self._unsaved = -1, 0
        self._knobs: tuple[Iterable[DescribedParam], list[tuple[str, object]]] = (), []

    def answer(self, request: object, peer: str = "") -> dict[str, object]:
        """Carry out one request: {"ok": what came of it} or {"refused": every rule broken}.

        peer: who is at the other end, as "process 123", "" where nobody knows
        """
        try:
            return {"ok": self._done(request, peer)}
        except self._refusals as error:
            return {"refused": str(error)}

    def _done(self, request: object, peer: str) -> object:
        """Find what is meant; the patterns are the protocol."""
        tuning = self._tuning
        match request:
            case {"do": "status", **rest} if not rest:
                return self._status()
            case {"do": "menus", **rest} if not rest:
                return {menu: list(choices) for menu, choices in self._robot.menus().items()}
            case {"do": "knobs", "prefix": str(prefix), **rest} if not rest:
                return [words for key, words in self._all_knobs() if key.startswith(prefix)]
            case {"do": "get", "prefix": str(prefix), **rest} if not rest:
                return plain(tuning.get(prefix))
            case {"do": "set", "changes": dict(changes), **rest} if not rest:
                return self._in_force(tuning.set({k: _frozen(v) for k, v in changes.items()}))
            case {"do": "unsaved", **rest} if not rest:
                return _changes(tuning.unsaved())
            case {"do": "differs", **rest} if not rest:
                return _changes(tuning.differs())
            case {"do": "save", "path": str() | None as path, **rest} if not rest:
                return self._save(path)
            case {"do": "revert", **rest} if not rest:
                return self._in_force(tuning.revert())
            case {"do": "characters", **rest} if not rest:
                return list(tuning.characters())
            case {"do": "character", "name": str(name), **rest} if not rest:
                return self._in_force(tuning.character(name))
            case {"do": "order", "order": dict(order), **rest} if not rest:
                return self._order(from_json(order), peer)
        raise ValueError(f"not understood; there is {'; '.join(REQUESTS)}")

    def _all_knobs(self) -> list[tuple[str, object]]:
        """Return key and plain values of every parameter; writing them all takes 4 ms."""
        knobs = self._tuning.knobs()
        if knobs is not self._knobs[0]:
            self._knobs = knobs, [(knob.key, plain(knob._asdict())) for knob in knobs]
        return self._knobs[1]

    def _status(self) -> dict[str, object]:
        version = self._tuning.version
        if version != self._unsaved[0]:  # else a program that polls would have it counted
            self._unsaved = version, len(tuple(self._tuning.unsaved()))
        about = {**self._about, "version": version, "unsaved": self._unsaved[1]}
        return {**about, **self._pulse.words()}

    def _save(self, path: str | None) -> dict[str, object]:
        if path is not None and not Path(path).is_absolute():
            raise ValueError(f"{path}: give the whole path; this program has another folder")
        saved = self._tuning.save(Path(path) if path is not None else None)
        if self._saved is not None:
            self._saved(saved.path)
        backup = None if saved.backup is None else str(saved.backup)
        return {"path": str(saved.path), "backup": backup, "changes": _changes(saved.changes)}

    def _order(self, order: Command, peer: str) -> object:
        """Hand on an order; parameters go through ``set``, which knows their rules."""
        if isinstance(order, Tune):
            raise ValueError("parameters are changed by the request set, which checks them")
        who = str(getattr(order, "who", ""))
        if peer:  # nobody can give himself out as another process, or as the page
            order = signed(order, f"{who} ({peer})" if who else peer)
        ticket = self._robot.order(order)
        if ticket is None:
            return self._in_force(())
        reply = ticket.wait(_TAKEN_UP_S)
        if reply is None:
            raise ValueError(_HANGS)
        if reply.refused:
            raise ValueError(reply.refused)
        if not isinstance(order, Renew):
            self._pulse.taken_up(ticks=1)  # so that the status tells of it
        return {"notes": [], "reply": reply.as_json()}

    def _in_force(self, notes: object) -> dict[str, object]:
        """Wait for the tick that obeys; pass on what a person should know."""
        words = [str(note) for note in notes] if isinstance(notes, tuple | list) else []
        if not self._pulse.taken_up():
            raise ValueError(_HANGS)
        return {"notes": words}


def is_stop(request: object) -> bool:
    """True if a request is to stop: nothing may hold that up."""
    match request:
        case {"do": "order", "order": {"order": "stop"}}:
            return True
    return False


def plain(value: object) -> object:
    """Make lists and dicts of tuples and mappings, as JSON has them."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    return value


def _changes(changes: Iterable[ChangedParam]) -> list[dict[str, object]]:
    return [{"key": c.key, "old": plain(c.old), "new": plain(c.new)} for c in changes]


def _frozen(value: object) -> Value:
    """Make tuples of JSON's lists, as the reader of files does."""
    if isinstance(value, list):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    assert value is None or isinstance(value, bool | int | float | str)
    return value
