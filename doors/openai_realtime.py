"""Door to OpenAI's realtime API and servers that speak it: a relay that reads the server's events.

The program connects to the door instead of the server (``websocket_base_url`` of the OpenAI
client), and the door to the server, with the program's own key, which it does not store. Names of
events: platform.openai.com/docs/api-reference/realtime-server-events; those of the beta in
brackets: ``response.output_audio.delta`` (``response.audio.delta``).
"""

import asyncio
import base64
import contextlib
import json
from collections.abc import Mapping
from typing import Any

from aiohttp import ClientSession, ClientWebSocketResponse, WSMessage, WSMsgType, web

from gazerig.doors.door import Door, DoorLink
from gazerig.doors.spoken_sound import SpokenSound
from gazerig.doors.turn_taking import Orders, TurnTaking, field
from gazerig.doors.web_socket import ERRORS, MAX_BYTES, listen

_PCM, _PCM_HZ = ("audio/pcm", "pcm16"), 24_000
"""16 bits a sample, the default; the formats of telephones have 8."""
_AUDIO = ("response.output_audio.delta", "response.audio.delta")
_AUDIO_DONE = ("response.output_audio.done", "response.audio.done")
_PASSED_ON = ("authorization", "openai-", "api-key", "user-agent", "x-")
"""Beginnings of the headers that the server needs."""
_LOOK_S = 0.1


class OpenAIRealtime:
    """Server events of one session as orders.

    The audio of an answer usually arrives faster than it is played, so the end of speech is
    computed from its length.

    Attributes:
        rate_hz: Rate of the audio's samples, 0 if they are those of a telephone.
    """

    def __init__(self) -> None:
        self.talk = TurnTaking("listening", streams_text=True)
        self.rate_hz = _PCM_HZ
        self._audio_s = 0.0
        self._complete = False
        self._session_type = ""
        self._detection: dict[str, Any] = {}
        self._detects = self._hears = False

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for a server event; other events are ignored."""
        talk = self.talk
        match message.get("type"):
            case "session.created" | "session.updated" as kind:
                session = field(message, "session", dict, {})
                self._read_format(session)
                if kind == "session.created":
                    self._session_type = field(session, "type", str, "")
                    self.read_detection(session)
            case "input_audio_buffer.speech_started":
                self._hears = True
                return talk.partner_speaks()
            case "input_audio_buffer.speech_stopped" | "input_audio_buffer.committed":
                self._hears = False
                return talk.partner_pauses()
            case "response.created":
                self._complete = False
                if talk.state != "speaking":  # otherwise the answers follow each other
                    self._audio_s = 0.0
                return talk.partner_pauses()
            case kind if kind in _AUDIO:
                # Base64: four characters for three bytes.
                length = len(field(message, "delta", str, "")) * 3 // 4
                if self.rate_hz:
                    self._audio_s += length / (2 * self.rate_hz)
                return talk.speak(now_s) if length else ()
            case "response.output_audio_transcript.delta" | "response.audio_transcript.delta":
                return talk.add_text(field(message, "delta", str, ""), now_s)
            case kind if kind in _AUDIO_DONE:
                seconds = self._audio_s or None
                return talk.speak(now_s, seconds) if talk.state == "speaking" else ()
            case "output_audio_buffer.stopped" | "output_audio_buffer.cleared":
                return talk.end_speech()
            case "response.done":
                self._complete = True
                if talk.state == "thinking":  # an answer without speech
                    return talk.end()
        return ()

    def sound(self, message: Mapping[str, Any]) -> bytes:
        """Return the samples of a server event, b"" without any or if they are a telephone's."""
        if not self.rate_hz or message.get("type") not in _AUDIO:
            return b""
        try:
            return base64.b64decode(field(message, "delta", str, ""), validate=True)
        except ValueError:
            return b""

    def due(self, now_s: float) -> Orders:
        """Return the orders for an answer that has been played to its end."""
        return self.talk.end_speech() if self._complete and self.talk.is_over(now_s) else ()

    def _read_format(self, session: Mapping[str, Any]) -> None:
        """Read the rate of the audio from a session."""
        output = field(field(session, "audio", dict, {}), "output", dict, {})
        audio = field(output, "format", dict, {})
        name = str(audio.get("type") or session.get("output_audio_format"))
        if name in _PCM:
            self.rate_hz = field(audio, "rate", int, 0) or _PCM_HZ
        elif name != "None":
            self.rate_hz = 0

    def read_detection(self, session: Mapping[str, Any]) -> None:
        """Read how a session, or the program's update of it, wants turns to be detected."""
        place = field(field(session, "audio", dict, {}), "input", dict, session)
        if "turn_detection" in place:
            self._detection = field(place, "turn_detection", dict, {})
            self._detects = bool(self._detection)

    @property
    def may_interrupt(self) -> bool:
        """Return whether the person may interrupt an answer, the default."""
        return bool(self._detection.get("interrupt_response", True))

    def detect_turns(self, addressed: bool) -> tuple[Mapping[str, Any], ...]:
        """Return the messages to the server that let it detect turns only while addressed.

        A turn that was begun is heard to its end. What was heard before the turns are detected is
        no part of them.
        """
        detects = addressed or self._hears
        if not self._detection or detects == self._detects:
            return ()
        self._detects = detects
        session: dict[str, Any] = {"turn_detection": self._detection if detects else None}
        if self._session_type:  # it is none of the beta
            session = {"type": self._session_type, "audio": {"input": session}}
        update = {"type": "session.update", "session": session}
        return ({"type": "input_audio_buffer.clear"}, update) if detects else (update,)


async def serve(link: DoorLink) -> None:
    """Relay sessions between programs and the server."""

    async def relay(request: web.Request) -> web.WebSocketResponse:
        kept = {
            name: value for name, value in request.headers.items()
            if name.lower().startswith(_PASSED_ON)
        }  # fmt: skip
        url = link.address.rstrip("/") + str(request.rel_url)
        try:
            async with (
                ClientSession() as session,
                session.ws_connect(url, headers=kept, max_msg_size=MAX_BYTES) as server,
            ):
                program = web.WebSocketResponse(max_msg_size=MAX_BYTES)
                await program.prepare(request)
                await _relay(link, program, server)
                return program
        except ERRORS as error:
            link.report(f"{link.address} refuses a session ({error}); check the program's key")
            raise web.HTTPBadGateway(text=str(error)) from None

    await listen(link, relay, f"a program's realtime session, relayed to {link.address},")


async def _relay(
    link: DoorLink, program: web.WebSocketResponse, server: ClientWebSocketResponse
) -> None:
    """Relay a session until one side ends it."""
    events, mouth = OpenAIRealtime(), SpokenSound(link, volume=0.0)

    async def tell(person: int | None) -> None:
        link.may_interrupt = events.may_interrupt
        for message in events.detect_turns(person is not None) if link.watches else ():
            await server.send_json(message)

    async def upwards() -> None:
        async for message in program:
            await _pass(server, message.type, message.data)
            if event := _event(message, '"session.update"'):
                events.read_detection(field(event, "session", dict, {}))
                await tell(link.addressed_by)
        await server.close(code=program.close_code or 1000)

    async def downwards() -> None:
        async for message in server:
            await _pass(program, message.type, message.data)
            if event := _event(message):
                link.send(events.take(event, link.now_s()))
                if pcm := events.sound(event):
                    mouth.add(pcm, events.rate_hz)
                elif event.get("type") in _AUDIO_DONE:
                    mouth.end()
                elif events.talk.state != "speaking":
                    mouth.shut()
                await tell(link.addressed_by)
        await program.close(code=server.close_code or 1000)

    async def look() -> None:
        while True:
            await asyncio.sleep(_LOOK_S)
            link.send(events.due(link.now_s()))

    tasks = [asyncio.ensure_future(one()) for one in (upwards, downwards, look)]
    try:
        with link.on_addressed(tell):
            await asyncio.wait(tasks[:2], return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        link.send(events.talk.end())
        mouth.shut()


def _event(message: WSMessage, kind: str = "") -> dict[str, Any]:
    """Return the event of a message whose text contains a kind, {} if it has none."""
    if message.type == WSMsgType.TEXT and kind in message.data:
        with contextlib.suppress(ValueError, RecursionError):
            if isinstance(event := json.loads(message.data), dict):
                return event
    return {}


async def _pass(
    to: web.WebSocketResponse | ClientWebSocketResponse, kind: WSMsgType, data: Any
) -> None:
    if kind == WSMsgType.TEXT:
        await to.send_str(data)
    elif kind == WSMsgType.BINARY:
        await to.send_bytes(data)


DOOR = Door(
    "openai-realtime", serve, "OpenAI's realtime API, and servers that speak it",
    address="wss://api.openai.com", bind="127.0.0.1:6057",
)  # fmt: skip
