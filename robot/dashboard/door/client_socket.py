"""One client of the websocket: what it wants to receive, what it controls, what waits for it."""

import asyncio
from collections import deque
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

import msgspec

from gazerig.robot.dashboard.door.rig_link import BUSY
from gazerig.robot.model.commands import COMMANDS, ORDERS, REPEATED, ControlCommand
from gazerig.robot.model.reply import CommandReply, Progress, command_outcome
from gazerig.robot.net.excess import STOPPED

NO_OUTCOME = {name for name, kind in COMMANDS.items() if kind in REPEATED}
CONTROLS = frozenset(name for name, kind in COMMANDS.items() if issubclass(kind, ControlCommand))
"""Verbs of the commands that give their client control of gaze or joints."""
MOST_RATE_HZ = 25.0
"""Highest rate of states."""
_MOST_QUEUED, _MOST_OUT = 16, 256
_REPORT_S = 0.25
"""Time in which dropped messages are counted for one refusal, s."""
_NO_PICTURE = "", b""
_MOST_OPEN = 64
"""Largest number of orders of one client without an outcome."""


class Wishes(msgspec.Struct, frozen=True):
    """What a client receives besides answers: states at a rate, 0 for none, and topics."""

    rate_hz: Annotated[float, msgspec.Meta(ge=1.0, le=MOST_RATE_HZ)] = 0.0
    events: bool = False
    pictures: bool = False
    rig: bool = False


class Visitor(NamedTuple):
    """Who sends a request: the name of the browser, "" for a program, and the address."""

    browser: str
    address: str

    @property
    def name(self) -> str:
        """Return the name of a visitor that has not chosen one."""
        return self.browser or f"a program at {self.address}"


class ClientSocket:
    """The messages from and for one client.

    States and pictures that it does not read in time are replaced by newer ones. If too many events
    or answers wait, the oldest are dropped.

    Args:
        wishes: What the client receives.
        visitor: Who it is.
        name: Name of the websocket; who stopped resumes over the same one.

    Attributes:
        orders: messages that wait for the rig, in order.
        news: set when a message waits; alive: set when the client has answered a ping.
        ping: the newest ping of the client that is not answered yet.
        held: what the client controls: "gaze" (or joints), "talk" (the conversation).
        who: name under which it does.
    """

    def __init__(self, wishes: Wishes, visitor: Visitor, name: str) -> None:
        self.wishes, self.visitor, self.name = wishes, visitor, name
        self.orders: asyncio.Queue[dict[str, Any]] = asyncio.Queue(_MOST_QUEUED)
        self._period_s = 1.0 / wishes.rate_hz if wishes.rate_hz else 0.0
        self._due_s = self._not_before_s = 0.0
        self._state = ""
        self._picture, self._jpeg = _NO_PICTURE, b""
        self._out: deque[str] = deque(maxlen=_MOST_OUT)
        self._open: deque[tuple[object, CommandReply]] = deque(maxlen=_MOST_OPEN)
        self._dropped = 0
        self.news, self.alive = asyncio.Event(), asyncio.Event()
        self.ping: bytes | None = None
        self.held: set[str] = set()
        self.who = ""

    def wants_state(self, t_s: float, now_s: float) -> bool:
        """Return whether a state of a time is due; it may not be older than an answer."""
        # A little early is better than one period late.
        return (
            self._period_s > 0.0
            and now_s >= self._due_s - 0.25 * self._period_s
            and t_s >= self._not_before_s
        )

    def add_state(self, text: str, now_s: float) -> None:
        """Store a state that is due."""
        self._due_s = max(self._due_s, now_s - 0.5 * self._period_s) + self._period_s
        self._state = text
        self.news.set()

    def add_picture(self, text: str, jpeg: bytes) -> None:
        """Store a picture, as encoded, instead of one that was not read yet."""
        self._picture = text, jpeg
        self.news.set()

    def add_progress(self, progress: Progress) -> None:
        """Send the outcomes that are known now."""
        for _ in range(len(self._open)):
            tag, reply = self._open.popleft()
            if (end := command_outcome(reply, progress)) is None:
                self._open.append((tag, reply))
            else:
                self.queue_message({"outcome": end[0], "why": end[1], "tag": tag})

    def queue_text(self, text: str) -> None:
        """Send an encoded message as soon as the client reads it."""
        self._out.append(text)
        self.news.set()

    def queue_message(self, message: Mapping[str, object]) -> None:
        """Send a message as soon as the client reads it."""
        self.queue_text(msgspec.json.encode(message).decode())

    def queue_answer(self, message: Mapping[str, object], answer: Mapping[str, object]) -> None:
        """Send the answer to a message, and record what an accepted one controls."""
        match answer:
            case {"ok": {"reply": dict(found)}}:
                reply = msgspec.convert(found, CommandReply)
                if message["do"] not in NO_OUTCOME:
                    self._not_before_s, self._state = reply.t_s, ""
                    if "tag" in message and message["do"] != "stop":
                        self._open.append((message["tag"], reply))
                self.hold(message, reply)
        self.queue_message(answer)

    def hold(self, message: Mapping[str, object], reply: CommandReply) -> None:
        """Record what an accepted message controls until it is no longer renewed."""
        talks = message["do"] == "talk"
        if talks or message["do"] in CONTROLS:
            starts = message.get("state") != "idle" if talks else bool(reply.control_number)
            # A pointer controls the gaze only while it moves.
            lasts = message.get("stay") or message.get("pointer")
            change = self.held.add if starts and not lasts else self.held.discard
            change("talk" if talks else "gaze")
            self.who = str(message["who"])

    def refuse_commands(self) -> None:
        """Refuse the commands that wait: a resume from before a stop must not follow it."""
        for _ in range(self.orders.qsize()):
            message = self.orders.get_nowait()
            if message.get("do") in ORDERS:
                self.queue_message({"refused": STOPPED, **tag_of(message)})
            else:
                self.orders.put_nowait(message)

    def drop_message(self) -> None:
        """Count a message that is too many; one refusal follows for all of a short time."""
        if not self._dropped:
            asyncio.get_running_loop().call_later(_REPORT_S, self._refuse_dropped)
        self._dropped += 1

    def _refuse_dropped(self) -> None:
        self.queue_message({"refused": BUSY, "messages": self._dropped})
        self._dropped = 0

    def outgoing(self) -> str | bytes:
        """Return the next message to send, answers and events first, "" if there is none."""
        if self._jpeg:  # its text has just been sent
            jpeg, self._jpeg = self._jpeg, b""
            return jpeg
        if self._out:
            return self._out.popleft()
        if self._state:
            state, self._state = self._state, ""
            return state
        (picture, self._jpeg), self._picture = self._picture, _NO_PICTURE
        return picture


def tag_of(message: Mapping[str, object]) -> dict[str, object]:
    """Return the tag of a message, which its answer has, too."""
    return {"tag": message["tag"]} if "tag" in message else {}
