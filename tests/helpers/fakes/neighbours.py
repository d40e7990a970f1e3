"""Messages of the neighbours of doors, and a door that runs before a recording head."""

import asyncio
import base64
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import yaml
from aiohttp import web
from fakes.talking_head import TalkingHead, until
from fakes.voice_assistant import free_port, lva

from gazerig.doors import livekit, openai_realtime, pipecat, voice_assistant, wyoming
from gazerig.doors.door import Door, DoorLink


def rtvi(kind: str, text: str | None = None) -> dict[str, Any]:
    data = {} if text is None else {"data": {"text": text}}
    return {"label": "rtvi-ai", "type": kind, "id": "1", **data}


def agent(state: str) -> dict[str, Any]:
    return {"lk.agent.state": state}


def wyo(kind: str, audio_s: float | None = None, **data: Any) -> dict[str, Any]:
    return {"type": kind, "data": data} | ({} if audio_s is None else {"audio_s": audio_s})


def event(kind: str, **rest: Any) -> dict[str, Any]:
    """Return an event of OpenAI with the fields that its kinds require."""
    required: dict[str, Any] = {
        "event_id": "e", "item_id": "i", "previous_item_id": None, "response_id": "r",
        "output_index": 0, "content_index": 0, "audio_start_ms": 0, "audio_end_ms": 0,
        "response": {}, "rate_limits": [], "session": {"type": "realtime"},
    }  # fmt: skip
    return {**required, "type": kind, **rest}


def audio(
    seconds: float, bytes_per_s: int = 48_000, kind: str = "response.output_audio.delta"
) -> dict[str, Any]:
    pcm = bytes(round(seconds * bytes_per_s))
    return event(kind, delta=base64.b64encode(pcm).decode())


MAKERS: dict[str, tuple[Callable[[], Any], Callable[..., Mapping[str, Any]]]] = {
    "voice assistant": (voice_assistant.VoiceAssistant, lva),
    "pipecat": (pipecat.Pipecat, rtvi),
    "livekit": (livekit.LiveKit, dict),
    "wyoming": (wyoming.Wyoming, wyo),
    "openai": (openai_realtime.OpenAIRealtime, event),
}


def conversation(name: str) -> list[tuple[Mapping[str, Any], list[Any]]]:
    """Return the messages of a neighbour and the orders that each becomes."""
    file = Path(__file__).parents[2] / "golden" / "conversations.yaml"
    rows = yaml.safe_load(file.read_text())[name]
    make = MAKERS[name][1]
    return [
        (
            (audio if "seconds" in fields else make)(**fields),
            [tuple(order) if isinstance(order, list) else order for order in orders],
        )
        for fields, orders in rows
    ]


Scenario = Callable[[DoorLink, TalkingHead], Awaitable[object]]


class RealtimeServer:
    """A realtime API at a port of this computer, which records what it receives.

    Args:
        answers: Events that it sends to a program that connects.
    """

    def __init__(self, *answers: Mapping[str, Any]) -> None:
        self.port, self._answers = free_port(), answers
        self.received: list[Any] = []
        self.socket = web.WebSocketResponse()

    async def __aenter__(self) -> "RealtimeServer":
        app = web.Application()
        app.router.add_get("/v1/realtime", self._accept)
        self._runner = web.AppRunner(app, shutdown_timeout=0.1, handler_cancellation=True)
        await self._runner.setup()
        await web.TCPSite(self._runner, "127.0.0.1", self.port).start()
        return self

    async def __aexit__(self, *raised: object) -> None:
        await self._runner.cleanup()

    async def _accept(self, request: web.Request) -> web.WebSocketResponse:
        self.asked = str(request.rel_url), request.headers.get("Authorization")
        await self.socket.prepare(request)
        for answer in self._answers:
            await self.socket.send_json(answer)
        async for message in self.socket:
            self.received.append(message.json())
        return self.socket


def run(
    door: Door, scenario: Scenario, address: str = "", bind: str = "", addressed: bool = False
) -> TalkingHead:
    """Run a door with a recording head until a scenario, begun at its first words, has ended."""
    head = TalkingHead()
    link = DoorLink(head.connect, head.said.append, address, bind, addressed)

    async def both() -> None:
        tasks = [asyncio.ensure_future(door.serve(link)), asyncio.ensure_future(link.run())]
        try:
            await until(lambda: head.said)
            await scenario(link, head)
            assert not any(task.done() for task in tasks)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(both())
    return head


class Emitter:
    """Calls what was registered, as livekit.rtc.EventEmitter does."""

    def __init__(self) -> None:
        self.handlers: dict[str, Callable[..., object]] = {}
        self.remote_participants: dict[str, Any] = {}
        self.joined: tuple[str, ...] = ()
        self.local_participant: Any = None

    def on(self, name: str, handler: Callable[..., object]) -> None:
        self.handlers[name] = handler

    async def connect(self, *joined: str) -> None:
        self.joined = joined

    async def disconnect(self) -> None:
        self.joined = ()


def talk_in_a_room(participant: Any, calls: list[str]) -> TalkingHead:
    """Let a person address an agent, look away, look again, be answered, and still look.

    Args:
        participant: The door's, with ``perform_rpc``.
        calls: Receives one entry whenever a method of the agent is called.
    """
    head, room = TalkingHead(), Emitter()
    subscribed: list[bool] = []

    async def stream(part: Any) -> AsyncIterator[Any]:
        yield part

    async def scenario() -> None:
        link = DoorLink(head.connect, head.said.append, "ws://room", watches=True)
        running = asyncio.ensure_future(link.run())
        sound = SimpleNamespace(kind=1, subscribed=False, set_subscribed=subscribed.append)
        known = SimpleNamespace(attributes=agent("thinking"), track_publications={"s": sound})
        room.remote_participants = {"agent": known, "phone": SimpleNamespace(attributes={})}
        room.local_participant = participant
        following = asyncio.ensure_future(
            livekit.follow_room(link, room, "token", "options", stream)
        )
        await until(lambda: calls and head.states == ["thinking"])
        assert room.joined == ("ws://room", "token", "options") and subscribed == [True]
        for person, state in ((3, ""), (None, ""), (3, ""), (3, "speaking"), (3, "listening")):
            count = len(calls)
            if state:
                room.handlers["participant_attributes_changed"](agent(state), None)
                await head.reaches(state)
            if state == "speaking":
                room.handlers["track_subscribed"](bytes(640), sound, known)
            head.addressed_by = person
            await until(lambda count=count: len(calls) > count)  # type: ignore[misc]
        room.handlers["participant_disconnected"](SimpleNamespace(attributes=agent("speaking")))
        await head.reaches("idle")
        room.handlers["disconnected"]("closed")
        await following
        running.cancel()

    asyncio.run(scenario())
    assert head.mouths == [(16_000, 1, bytes(640))] and "speech" in head.ended_tracks
    assert room.joined == () and not any("token" in line for line in head.said)
    return head
