"""Programs of the network: the messages of the command socket over HTTP and a websocket.

GET  /api/v1/state          newest state
POST /api/v1/do             one message; an order's answer has its outcome
GET  /api/v1/socket         websocket: messages in both directions, states, events
GET  /api/v1/openapi.json   description
"""

import asyncio
import fcntl
import json
import os
import struct
import termios
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from typing import Any

import aiohttp
import msgspec
from aiohttp import web

from gazerig.robot.dashboard.door.admission import API
from gazerig.robot.dashboard.door.browsers import Connections, TabLimits
from gazerig.robot.dashboard.door.sockets import TAKES_S, close_socket, until_one_ends
from gazerig.robot.dashboard.requests.outbox import UNCONFIRMED, takes_control
from gazerig.robot.dashboard.requests.rig_relay import (
    BUSY,
    NEWEST,
    Answer,
    HeadNews,
    RigRelay,
    StateFeed,
)
from gazerig.robot.dashboard.requests.stop_sender import StopSender
from gazerig.robot.model.commands import HEARTBEAT_S, REPEATED, ClientCommand, Resume, Stop
from gazerig.robot.model.outcome import command_outcome
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.requests import ORDERS
from gazerig.robot.remote.excess import (
    CLOSED,
    REST_S,
    STOPPED,
    TOO_MANY,
    ExcessCount,
    TokenBucket,
    find_stop,
)
from gazerig.robot.remote.openapi import MOST_RATE_HZ, MOST_WAIT_S, WAIT_S, api_description
from gazerig.robot.remote.socket_io import REQUEST_BYTES, VERSION

BASE = f"{API}v{VERSION}"
MOST_PROGRAMS = 32
"""Largest number of websockets of programs; equal to that of tabs of the page."""
_EVENTS_HZ = 20.0
"""Rate at which the state of the head is read for events and outcomes."""
_PER_S, _BURST = 50.0, 100.0
_ALL_PER_S, _ALL_BURST = 100.0, 200.0
_READ_S = 5.0
_MOST_QUEUED = 16
_MOST_OUT = 256
_MOST_RESTS = 10
"""Stops are received for so many times REST_S while more of a program's data waits to be read."""
_REPORT_S = 0.25
"""Time in which dropped messages are counted for one refusal, s."""
_MOST_OPEN = 64
"""Largest number of orders of one program without an outcome."""
_WHO_CHARACTERS = 60
_TAG_CHARACTERS = 100
_NO_OUTCOME = {name for name, kind in ORDERS.items() if kind in REPEATED}
_ENDS = (aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSING, aiohttp.WSMsgType.CLOSED,
         aiohttp.WSMsgType.ERROR)  # fmt: skip
_STATUS = {"ok": 200, "refused": 409, "failed": 503}


class MessageRefused(ValueError):
    """Refusal of a message to the rig; the text gives the reason.

    Attributes:
        status: Status of the HTTP answer.
    """

    def __init__(self, text: str, status: int = 400) -> None:
        super().__init__(text)
        self.status = status


def parse_message(data: str | bytes) -> dict[str, Any]:
    """Parse a message that was received as text.

    Raises:
        MessageRefused: it is too long, or not a JSON object.
    """
    if len(data) > REQUEST_BYTES:
        raise MessageRefused(f"longer than {REQUEST_BYTES} bytes", 413)
    try:
        found = msgspec.json.decode(data)
    except RecursionError:
        raise MessageRefused("nested too deep") from None
    except ValueError as error:
        raise MessageRefused(f"not JSON: {error}") from None
    if not isinstance(found, dict):
        raise MessageRefused('not a JSON object like {"do": "status"}')
    tag = found.get("tag", 0)
    if not isinstance(tag, str | int) or len(str(tag)) > _TAG_CHARACTERS:
        raise MessageRefused(f"tag: a whole number or text of at most {_TAG_CHARACTERS} characters")
    return found


def parse_rate(text: str, name: str, least: float, most: float) -> float:
    """Parse a rate from a query.

    Raises:
        MessageRefused: it is outside the bounds.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not least <= value <= most:
        raise MessageRefused(f"{name}={text:.20}: a number {least:g}..{most:g}")
    return value


class ProgramSocket:
    """Websocket of one program: the messages that wait to be sent, and what it controls.

    States that the program does not read in time are replaced by newer ones. If too many events
    or answers wait, the oldest are dropped.

    Args:
        rate_hz: rate of states, 0 for none.
        events: whether the program receives events.

    Attributes:
        news: set when a message waits; alive: set when the program has answered a ping.
        ping: the newest ping of the program that is not answered yet.
        held: what the program controls: "gaze" (or joints), "talk" (the conversation).
        who: name under which it does.
        name: name of the websocket.
    """

    def __init__(self, rate_hz: float, events: bool) -> None:
        self._rate_hz, self._events = rate_hz, events
        self._period_s = 1.0 / rate_hz if rate_hz else 0.0
        self._due_s = self._answered_s = 0.0
        self._state = ""
        self._out: deque[str] = deque(maxlen=_MOST_OUT)
        self._open: deque[tuple[object, CommandReply]] = deque(maxlen=_MOST_OPEN)
        self._dropped = 0
        self.news, self.alive = asyncio.Event(), asyncio.Event()
        self.ping: bytes | None = None
        self.held: set[str] = set()
        self.who = self.name = ""

    def wanted_hz(self) -> float:
        """Return the rate at which the program needs the state of the head."""
        return max(self._rate_hz, _EVENTS_HZ if self._events or self._open else 0.0)

    def add_news(self, news: HeadNews, now_s: float) -> None:
        """Store the news that the program wants; now_s: before the state was read."""
        period_s = self._period_s
        # A little early is better than one period late; a state may not be older than an answer.
        if period_s and now_s >= max(self._due_s - 0.25 * period_s, self._answered_s):
            self._due_s = max(self._due_s, now_s - 0.5 * period_s) + period_s
            self._state = news.state
            self.news.set()
        if self._events and news.events:
            self._out.extend(news.events)
            self.news.set()
        for _ in range(len(self._open)):
            tag, reply = self._open.popleft()
            if (end := command_outcome(reply, news.progress)) is None:
                self._open.append((tag, reply))
            else:
                self.queue_message({"outcome": end[0], "why": end[1], "tag": tag})

    def hold(self, message: Mapping[str, object], reply: CommandReply) -> None:
        """Record what an accepted message controls until it is no longer renewed."""
        talks = message["do"] == "talk"
        if talks or takes_control(message):
            starts = message.get("state") != "idle" if talks else bool(reply.control_number)
            change = self.held.add if starts and not message.get("stay") else self.held.discard
            change("talk" if talks else "gaze")
            self.who = str(message["who"])

    def follow(self, tag: object, reply: CommandReply) -> None:
        """Send the outcome of an order when it is known."""
        self._open.append((tag, reply))

    def queue_message(self, message: Mapping[str, object]) -> None:
        """Send a message as soon as the program reads it."""
        self._out.append(json.dumps(message, separators=(",", ":")))
        self.news.set()

    def drop_message(self) -> None:
        """Count a message that is too many; one refusal follows for all of a short time."""
        if not self._dropped:
            asyncio.get_running_loop().call_later(_REPORT_S, self._refuse_dropped)
        self._dropped += 1

    def _refuse_dropped(self) -> None:
        self.queue_message({"refused": BUSY, "messages": self._dropped})
        self._dropped = 0

    def queue_answer(
        self, message: Mapping[str, object], answer: Mapping[str, object], now_s: float
    ) -> None:
        """Send the answer to a message; states that follow it are not older than an order's."""
        if message.get("do") not in _NO_OUTCOME:
            self._answered_s = now_s
            if self._state:
                self._out.append(self._state)
                self._state = ""
        self.queue_message(answer)

    def outgoing(self) -> str:
        """Return the next message to send, answers and events first, "" if there is none."""
        if self._out:
            return self._out.popleft()
        state, self._state = self._state, ""
        return state


class ProgramRoutes:
    """Routes for programs; used in the door's event loop.

    Args:
        relay: relay to the rig.
        stop: receives stops, before all other requests.
        over: set when the page closes.
        headers: headers of all answers.
    """

    def __init__(
        self,
        relay: RigRelay,
        stop: StopSender,
        over: asyncio.Event,
        headers: Mapping[str, str],
    ) -> None:
        self._relay, self._stop, self._over, self._headers = relay, stop, over, headers
        self.feed = StateFeed(relay.ask)
        self._rate = TokenBucket(_ALL_PER_S, _ALL_BURST)
        self._limits = TabLimits(MOST_PROGRAMS)
        self._websockets = 0

    def add_to(self, router: web.UrlDispatcher, connections: Callable[[], Connections]) -> None:
        """Add the routes; ``connections`` returns those of the door, once it is open."""
        self._connections = connections
        router.add_route("*", API + "{path:.*}", self._handle)

    async def _handle(self, request: web.Request) -> web.StreamResponse:
        try:
            match request.method, request.path.removeprefix(f"{BASE}/"):
                case "GET", "state":
                    return await self._state(request)
                case "POST", "do":
                    return await self._post(request)
                case "GET", "socket":
                    return await self._socket(request)
                case "GET", "openapi.json":
                    return self._answer(api_description(BASE), 200)
            raise MessageRefused(
                f"{request.method} {request.path:.60} is not here: version {VERSION} is at {BASE}/",
                404,
            )
        except MessageRefused as error:
            return self.refuse(str(error), error.status)

    def refuse(self, text: str, status: int = 403) -> web.Response:
        """Return an answer that refuses a request."""
        return self._answer({"refused": text}, status)

    # --- HTTP ---------------------------------------------------------------------------

    async def _state(self, request: web.Request) -> web.StreamResponse:
        after = int(parse_rate(request.query.get("after", f"{NEWEST}"), "after", 0, NEWEST))
        return await self._forward_request({"do": "state", "after": after})

    async def _post(self, request: web.Request) -> web.StreamResponse:
        wait_s = parse_rate(request.query.get("wait_s", f"{WAIT_S}"), "wait_s", 0.0, MOST_WAIT_S)
        data = b""
        async with asyncio.timeout(_READ_S):
            while len(data) <= REQUEST_BYTES and (more := await request.content.readany()):
                data += more
        message = _add_client(parse_message(data), request)
        if message.get("do") == "resume" and message.get("confirmed") is not True:
            raise MessageRefused(UNCONFIRMED, 409)
        if message.get("do") != "stop" and not self._is_within_rate():
            raise MessageRefused(BUSY, 429)
        ends = "seconds" if message.get("do") == "talk" else "for_s"
        if (ends == "seconds" or takes_control(message)) and message.get(ends) is not None:
            # The order ends after its duration; a request has no connection that could be lost.
            message["stay"] = True
        return await self._forward_request(message, wait_s)

    async def _forward_request(self, message: dict[str, Any], wait_s: float = 0.0) -> web.Response:
        answer = await self._send_to_rig(message)
        match answer:
            case {"ok": {"reply": dict(reply)}} if wait_s and message["do"] not in _NO_OUTCOME:
                answer |= await self._outcome(message, msgspec.convert(reply, CommandReply), wait_s)
        status = _STATUS[next(key for key in _STATUS if key in answer)]
        return self._answer(answer, 429 if answer.get("refused") == BUSY else status)

    async def _outcome(
        self, message: Mapping[str, Any], reply: CommandReply, wait_s: float
    ) -> dict[str, object]:
        """Wait for the outcome of an order, and renew its control meanwhile."""
        loop = asyncio.get_running_loop()
        found: asyncio.Future[tuple[str, str]] = loop.create_future()

        def take(news: HeadNews, now_s: float) -> None:
            end = command_outcome(reply, news.progress)
            if end is not None and not found.done():
                found.set_result(end)

        self.feed.add(take, lambda: _EVENTS_HZ)
        renewing = reply.control_number and not message.get("stay")
        end_s = loop.time() + wait_s
        try:
            while (left_s := end_s - loop.time()) > 0.0:
                done, _ = await asyncio.wait([found], timeout=min(0.25 * HEARTBEAT_S, left_s))
                if done:
                    outcome, why = found.result()
                    return {"outcome": outcome, "why": why}
                if renewing:
                    await self._relay.ask({"do": "renew", "who": message["who"]})
        finally:
            self.feed.remove(take)
        return {"outcome": "timed out", "why": ""}

    def _answer(self, answer: Mapping[str, object], status: int) -> web.Response:
        return web.json_response(answer, status=status, headers=self._headers)

    # --- the websocket ------------------------------------------------------------------

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if "upgrade" not in request.headers:
            raise MessageRefused("this is a websocket", 426)
        events = request.query.get("events", "false")
        if events not in ("true", "false"):
            raise MessageRefused(f"events={events:.20}: true or false")
        rate_hz = 0.0
        if (text := request.query.get("rate_hz")) is not None:
            rate_hz = parse_rate(text, "rate_hz", 1.0, MOST_RATE_HZ)
        program = ProgramSocket(rate_hz, events == "true")
        self._websockets += 1
        program.name = f"websocket {self._websockets}"
        socket = web.WebSocketResponse(
            max_msg_size=4 * REQUEST_BYTES, compress=False, autoping=False
        )
        await socket.prepare(request)
        self._connections().mark_websocket(request)
        orders: asyncio.Queue[dict[str, Any]] = asyncio.Queue(_MOST_QUEUED)
        orders.put_nowait({"do": "hello", "version": VERSION, "tag": "hello"})
        self.feed.add(program.add_news, program.wanted_hz)
        excess = ExcessCount()
        try:
            with self._limits.occupy(request.remote or "") as leave:
                await until_one_ends(
                    _outlasted(self._send(socket, program)),
                    self._receive(socket, program, orders, request, excess),
                    self._carry_out(program, orders),
                    _outlasted(self._renew(socket, program)),
                    self._over.wait(),
                    leave.wait(),
                )
        finally:
            self.feed.remove(program.add_news)
        await close_socket(socket, request, CLOSED if excess.is_over else "")
        return socket

    async def _send(self, socket: web.WebSocketResponse, program: ProgramSocket) -> None:
        while not socket.closed:
            await program.news.wait()
            program.news.clear()
            async with asyncio.timeout(TAKES_S):
                if (ping := program.ping) is not None:
                    program.ping = None
                    await socket.pong(ping)
            while text := program.outgoing():
                async with asyncio.timeout(TAKES_S):
                    await socket.send_str(text)

    async def _receive(
        self,
        socket: web.WebSocketResponse,
        program: ProgramSocket,
        orders: "asyncio.Queue[dict[str, Any]]",
        request: web.Request,
        excess: ExcessCount,
    ) -> None:
        """Receive messages; nothing here waits except a stop, so that a stop never waits.

        A program that sends far too many messages is disconnected, after the stops among those
        that it has sent.
        """
        loop = asyncio.get_running_loop()
        rate = TokenBucket(_PER_S, _BURST)
        while not excess.is_over:
            frame = await socket.receive()
            if frame.type in _ENDS:
                return
            now_s = loop.time()
            late = frame.type is aiohttp.WSMsgType.TEXT and not rate.take(now_s)
            if late and not _may_stop(frame):
                program.drop_message()
            else:
                await self._receive_frame(frame, program, orders, request, late)
            excess.add(late, now_s)
        program.queue_message({"refused": CLOSED})
        for _ in range(_MOST_RESTS):
            with suppress(TimeoutError):
                async with asyncio.timeout(REST_S):
                    while (frame := await socket.receive()).type not in _ENDS:
                        if _may_stop(frame):
                            await self._receive_frame(frame, program, orders, request, late=True)
                    return
            if not _unread_bytes(request):
                return

    async def _receive_frame(
        self,
        frame: aiohttp.WSMessage,
        program: ProgramSocket,
        orders: "asyncio.Queue[dict[str, Any]]",
        request: web.Request,
        late: bool,
    ) -> None:
        """Receive one message; of one that is too many only a stop is carried out."""
        if frame.type is aiohttp.WSMsgType.PING:
            program.ping = frame.data  # answered by the sender, as the program may not read
            program.news.set()
        elif frame.type is aiohttp.WSMsgType.PONG:
            program.alive.set()
        elif frame.type is not aiohttp.WSMsgType.TEXT:
            program.queue_message({"refused": "not text: one JSON object in each message"})
        else:
            try:
                message = _add_client(parse_message(frame.data), request, program.name)
                if message.get("do") == "stop":
                    _refuse_commands(program, orders)
                    answer = await self._send_to_rig(message)
                    program.queue_answer(message, answer, asyncio.get_running_loop().time())
                elif late or orders.full() or not self._is_within_rate():
                    program.queue_message({"refused": BUSY, **_tag(message)})
                else:
                    orders.put_nowait(message)
            except MessageRefused as error:
                program.queue_message({"refused": str(error)})

    async def _carry_out(
        self, program: ProgramSocket, orders: "asyncio.Queue[dict[str, Any]]"
    ) -> None:
        """Send a program's messages to the rig, in order."""
        while True:
            message = await orders.get()
            answer = await self._send_to_rig(message)
            program.queue_answer(message, answer, asyncio.get_running_loop().time())
            match answer:
                case {"ok": {"reply": dict(reply)}}:
                    found = msgspec.convert(reply, CommandReply)
                    program.hold(message, found)
                    if "tag" in message and message["do"] not in _NO_OUTCOME:
                        program.follow(message["tag"], found)
                        self.feed.wake()

    async def _renew(self, socket: web.WebSocketResponse, program: ProgramSocket) -> None:
        """Ping a program in control; each answer renews its control.

        A program that hangs or does not read loses control within a second, like one that has
        disconnected.
        """
        while True:
            await asyncio.sleep(0.25 * HEARTBEAT_S)
            if not program.held:
                continue
            program.alive.clear()
            async with asyncio.timeout(TAKES_S):
                await socket.ping()
                await program.alive.wait()
            answer = await self._relay.ask({"do": "renew", "who": program.who})
            if "refused" in answer and TOO_MANY not in answer["refused"]:
                program.held.clear()  # another client, or no client, is in control

    # --- the rig ------------------------------------------------------------------------

    def _is_within_rate(self) -> bool:
        return self._rate.take(asyncio.get_running_loop().time())

    async def _send_to_rig(self, message: Mapping[str, Any]) -> Answer:
        """Send a message to the rig, a stop by its own channel; return the answer."""
        if message.get("do") != "stop":
            return await self._relay.ask(message)
        # The command socket adds the process to the name; the client that stopped may resume.
        who = f"{message['who']} (process {os.getpid()})"
        try:
            text = await self._stop.send(f"{message.get('why', '')!s:.100}", who)
        except OSError as error:
            text = str(error)
        answer: Answer = {"failed": text} if text else {"ok": {"notes": []}}
        return answer | _tag(message)


def _add_client(
    message: dict[str, Any], request: web.Request, websocket: str = ""
) -> dict[str, Any]:
    """Return a message with the program's address and its name, which the program may choose.

    websocket: name of the websocket for a stop or a resume; who stopped resumes over the same one
    """
    kind = ORDERS.get(str(message.get("do")))
    if kind is None or not issubclass(kind, ClientCommand):
        return message
    name = "".join(filter(str.isprintable, str(message.get("who") or "a program")))
    here = f", {websocket}" if websocket and kind in (Stop, Resume) else ""
    return {**message, "who": f"{name[:_WHO_CHARACTERS]} at {request.remote}{here}"}


def _unread_bytes(request: web.Request) -> int:
    """Return how much of what a program has sent waits in the kernel."""
    end = request.transport and request.transport.get_extra_info("socket")
    if not end:
        return 0
    (unread,) = struct.unpack("i", fcntl.ioctl(end.fileno(), termios.FIONREAD, bytes(4)))
    return int(unread)


def _may_stop(frame: aiohttp.WSMessage) -> bool:
    return (
        frame.type is aiohttp.WSMsgType.TEXT and find_stop(frame.data[:REQUEST_BYTES].encode()) >= 0
    )


async def _outlasted(sending: Awaitable[None]) -> None:
    """Await a task that sends; if it fails, leave time to receive what the program has sent."""
    try:
        await sending
    except (ConnectionError, TimeoutError):
        await asyncio.sleep(REST_S)


def _refuse_commands(program: ProgramSocket, orders: "asyncio.Queue[dict[str, Any]]") -> None:
    """Refuse the commands that wait: a resume from before a stop must not be carried out after."""
    for _ in range(orders.qsize()):
        message = orders.get_nowait()
        if message.get("do") in ORDERS:
            program.queue_message({"refused": STOPPED, **_tag(message)})
        else:
            orders.put_nowait(message)


def _tag(message: Mapping[str, object]) -> dict[str, object]:
    return {"tag": message["tag"]} if "tag" in message else {}
