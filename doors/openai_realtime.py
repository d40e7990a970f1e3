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

from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType, web

from gazerig.doors.door import Door, DoorLink
from gazerig.doors.spoken_sound import MouthSound
from gazerig.doors.turn_taking import Orders, TurnTaking, field
from gazerig.doors.web_socket import ERRORS, Intake, listen

_MAX_BYTES = 16_000_000
_PCM, _PCM_HZ = ("audio/pcm", "pcm16"), 24_000
"""16 bits a sample, the default."""
_G711, _G711_HZ = ("audio/pcmu", "audio/pcma", "g711_ulaw", "g711_alaw"), 8_000
"""8 bits a sample."""
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
        self._bytes_per_s, self.rate_hz = 2 * _PCM_HZ, _PCM_HZ
        self._audio_s = 0.0
        self._complete = False

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for a server event; other events are ignored."""
        talk = self.talk
        match message.get("type"):
            case "session.created" | "session.updated":
                self._read_format(field(message, "session", dict, {}))
            case "input_audio_buffer.speech_started":
                return talk.partner_speaks()
            case "input_audio_buffer.speech_stopped" | "input_audio_buffer.committed":
                return talk.partner_pauses()
            case "response.created":
                self._complete = False
                if talk.state != "speaking":  # otherwise the answers follow each other
                    self._audio_s = 0.0
                return talk.partner_pauses()
            case kind if kind in _AUDIO:
                # Base64: four characters for three bytes.
                length = len(field(message, "delta", str, "")) * 3 // 4
                self._audio_s += length / self._bytes_per_s
                return talk.speak(now_s) if length else ()
            case "response.output_audio_transcript.delta" | "response.audio_transcript.delta":
                return talk.add_text(field(message, "delta", str, ""), now_s)
            case kind if kind in _AUDIO_DONE:
                return talk.speak(now_s, self._audio_s) if talk.state == "speaking" else ()
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
        if name in _G711:
            self._bytes_per_s, self.rate_hz = _G711_HZ, 0
        elif name in _PCM:
            self.rate_hz = field(audio, "rate", int, 0) or _PCM_HZ
            self._bytes_per_s = 2 * self.rate_hz


async def serve(link: DoorLink) -> None:
    """Relay sessions between programs and the server."""

    async def relay(request: web.Request) -> web.WebSocketResponse:
        kept = {
            name: value for name, value in request.headers.items()
            if name.lower().startswith(_PASSED_ON)
        }  # fmt: skip
        offered = request.headers.get("Sec-WebSocket-Protocol", "")
        protocols = tuple(one.strip() for one in offered.split(",") if one.strip())
        url = link.address.rstrip("/") + str(request.rel_url)
        try:
            async with (
                ClientSession() as session,
                session.ws_connect(
                    url, headers=kept, protocols=protocols, max_msg_size=_MAX_BYTES
                ) as server,
            ):
                chosen = (server.protocol,) if server.protocol else ()
                program = web.WebSocketResponse(protocols=chosen, max_msg_size=_MAX_BYTES)
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
    events = OpenAIRealtime()
    intake, mouth = Intake(link, events), MouthSound(link)

    async def upwards() -> None:
        async for message in program:
            await _pass(server, message.type, message.data)
        await server.close(code=program.close_code or 1000)

    async def downwards() -> None:
        async for message in server:
            await _pass(program, message.type, message.data)
            if message.type == WSMsgType.TEXT:
                with contextlib.suppress(ValueError, RecursionError):
                    if isinstance(event := json.loads(message.data), dict):
                        intake.translate(event)
                        if pcm := events.sound(event):
                            mouth.add(pcm, events.rate_hz)
                        elif event.get("type") in _AUDIO_DONE:
                            mouth.end()
                        elif events.talk.state != "speaking":
                            mouth.shut()
        await program.close(code=server.close_code or 1000)

    async def look() -> None:
        while True:
            await asyncio.sleep(_LOOK_S)
            link.send(events.due(link.now_s()))

    tasks = [asyncio.ensure_future(one()) for one in (upwards, downwards, look)]
    try:
        await asyncio.wait(tasks[:2], return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        intake.end()
        mouth.shut()


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
