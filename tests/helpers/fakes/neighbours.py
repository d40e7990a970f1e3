"""Messages of the neighbours of doors, and a door that runs before a recording head."""

import asyncio
import base64
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import yaml
from aiohttp import web
from fakes.talking_head import TalkingHead, until
from fakes.voice_assistant import lva

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


LVA, RTVI, LK = voice_assistant.VoiceAssistant, pipecat.Pipecat, livekit.LiveKit


WYO, OAI = wyoming.Wyoming, openai_realtime.OpenAIRealtime


MAKERS: dict[str, tuple[Callable[[], Any], Callable[..., Mapping[str, Any]]]] = {
    "voice assistant": (LVA, lva),
    "pipecat": (RTVI, rtvi),
    "livekit": (LK, dict),
    "wyoming": (WYO, wyo),
    "openai": (OAI, event),
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


Handler = Callable[[web.Request], Awaitable[web.WebSocketResponse]]


@asynccontextmanager
async def realtime_server(port: int, handle: Handler) -> AsyncIterator[None]:
    """Serve what a realtime API does at a port of this computer."""
    app = web.Application()
    app.router.add_get("/v1/realtime", handle)
    runner = web.AppRunner(app, shutdown_timeout=0.1, handler_cancellation=True)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", port).start()
    yield
    await runner.cleanup()


def run(door: Door, scenario: Scenario, address: str = "", bind: str = "") -> TalkingHead:
    """Run a door with a recording head until a scenario, begun at its first words, has ended."""
    head = TalkingHead()
    link = DoorLink(head.connect, head.said.append, address, bind)

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
