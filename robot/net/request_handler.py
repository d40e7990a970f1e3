"""Requests of another program to a running rig, and the answers, as plain JSON values.

{"do": "set", "changes": {"loop.rate_hz": 100.0}}  ->  {"ok": {"notes": []}}
{"do": "set", "changes": {"loop.rate_hz": 1e9}}    ->  {"refused": "... wanted 20 to 1000 ..."}
"""

import threading
from collections.abc import Callable, Mapping

from msgspec import structs

from gazerig.robot.loop.command_handler import REFUSALS, CommandHandler, PathGuard
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import HeadReport, head_state
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import (
    Character,
    ClientCommand,
    Command,
    Fault,
    Hello,
    ReadStatus,
    Request,
    Revert,
    Set,
    State,
    read_request,
    set_client,
)
from gazerig.robot.model.reply import Ticket
from gazerig.robot.net.socket_io import VERSION

_TAKEN_UP_S = 1.0
"""Timeout of the loop's execution, s; a servo that answers late delays it by some 50 ms."""
_WORDS = 20
"""Number of recent messages in the status."""

REAL = "only servos emulated byte by byte accept fault commands: gazerig run --mock, without --bus ideal"
_HANGS = (
    f"the control loop has not executed it within {_TAKEN_UP_S:g} s: it hangs, "
    "starts or ends; use the emergency stop if anything moves"
)


class LoopMonitor:
    """Newest tick, and whether the loop is running.

    Args:
        clock: Clock of the loop.

    Attributes:
        update: Stores the newest tick, for the loop.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._feed = TickFeed()
        self.update = self._feed.update
        self._never = threading.Event()

    def wait_for_commands(self, within_s: float = _TAKEN_UP_S, ticks: int = 2) -> bool:
        """Wait until all previous changes are applied; return whether they are.

        Args:
            within_s: Timeout, s.
            ticks: Ticks to wait for; the present one may have read the commands already, the next
                one has not.
        """
        wanted = self._feed.ticks + ticks
        waits = int(within_s / 0.002)
        while self._feed.ticks < wanted and waits > 0:
            self._never.wait(0.002)
            waits -= 1
        return self._feed.ticks >= wanted

    def state(self, after: int) -> HeadReport:
        """Return the newest tick, None before the first, and events numbered above ``after``."""
        tick = self._feed.newest
        state = head_state(tick) if tick else None
        return HeadReport(state, self._feed.events(after), self._feed.number)

    def status(self) -> dict[str, object]:
        """Return the state of the head with the loop's ticks and the last messages."""
        tick = self._feed.newest
        if tick is None:
            return {"ticks": 0, "stopped": "", "said": ()}
        state = head_state(tick)
        return {
            **structs.asdict(state),
            "ticks": self._feed.ticks,
            "age_s": self._clock.now_s() - tick.t_s,
            "camera": tick.camera_conditions,
            "said": [event.text for event in self._feed.messages()[-_WORDS:]],
        }


class RequestHandler:
    """Executes requests of other programs; answers {"ok": ...} or {"refused": ...}.

    Args:
        handler: Handles all requests except those about the loop.
        pulse: State of the loop.
        about: Constant fields of the status, e.g. {"rig": name, "pid": process}.
        fault: Executes a fault command of emulated servos; None if the servos are real.
        changing: Returns the other fields of the status, e.g. {"page": address}.
        paths: Rules for the files that a client may name; None if any.
    """

    def __init__(
        self,
        handler: CommandHandler,
        pulse: LoopMonitor,
        about: Mapping[str, object],
        fault: Callable[[str], str] | None = None,
        changing: Callable[[], Mapping[str, object]] = dict,
        paths: PathGuard | None = None,
    ) -> None:
        self._handler, self._pulse, self._paths = handler, pulse, paths
        self._changing, self._fault = changing, fault
        self._about = dict(about)
        self._unsaved = -1, 0

    def answer(self, message: object, peer: str = "") -> dict[str, object]:
        """Execute one request; return {"ok": result} or {"refused": every broken rule}.

        Args:
            message: Request {"do": verb, ...}. Its "tag" is returned with the answer.
            peer: Client at the other end, e.g. "process 123"; "" for the page, which names its own.
        """
        tag: dict[str, object] = {}
        if isinstance(message, dict):
            message = dict(message)
            tag = {"tag": message.pop("tag")} if "tag" in message else {}
        try:
            request = read_request(message)
            if peer and isinstance(request, ClientCommand):
                # The process is added: a client cannot pose as another one or the page.
                who = f"{request.who} ({peer})" if request.who else peer
                request = set_client(request, who)
            return {**self._execute(request), **tag}
        except REFUSALS as error:
            return {"refused": str(error), **tag}

    def _execute(self, request: Request) -> dict[str, object]:
        """Execute a request, and wait until the loop has done it."""
        match request:
            case Hello(version):
                if version != VERSION:
                    raise ValueError(
                        f"version {version} of the messages: this rig has {VERSION}; "
                        "update gazerig or the program"
                    )
                return {"ok": {"version": VERSION, **self._about}}
            case ReadStatus():
                return {"ok": self._status()}
            case State(after):
                return {"ok": self._pulse.state(after)}
            case Fault(text):
                if self._fault is None:
                    raise ValueError(REAL)
                return {"ok": self._fault(text)}
        done = self._handler.handle(request, self._paths)
        if isinstance(done, Ticket):
            reply = done.wait(_TAKEN_UP_S)
            if reply is None:
                raise ValueError(_HANGS)
            if reply.refused:
                return {"refused": reply.refused, "reply": reply}
            return {"ok": {"notes": (), "reply": reply}}
        if isinstance(request, Command | Set | Revert | Character):
            if not self._pulse.wait_for_commands():
                raise ValueError(_HANGS)
            return {"ok": {"notes": done or ()}}
        return {"ok": done}

    def _status(self) -> dict[str, object]:
        params = self._handler.params
        version = params.version if params is not None else 0
        if version != self._unsaved[0]:  # count once for a program that polls
            self._unsaved = version, len(params.unsaved()) if params is not None else 0
        about = {**self._about, **self._changing(), "version": version, "unsaved": self._unsaved[1]}
        return {**about, **self._pulse.status()}


def is_stop(message: object) -> bool:
    """Return whether a message is a stop, which nothing may delay."""
    return isinstance(message, dict) and message.get("do") == "stop"
