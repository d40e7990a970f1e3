"""Doors and the packages of their neighbours, which write and read what the doors read and write.

The packages are large, and their users have them: without one, its tests are skipped.
"""

import inspect
import re
from typing import Any, get_args

import pytest
from aiohttp import web
from fakes.neighbours import audio, conversation, event, realtime_server, run
from fakes.talking_head import TalkingHead
from fakes.voice_assistant import free_port

pytest.importorskip("gazerig.doors", reason="the folder doors was removed")

from gazerig.doors import openai_realtime
from gazerig.doors.door import DoorLink

BETA = ("response.audio.delta", "response.audio.done", "response.audio_transcript.delta")
"""Events of the beta, which the package of today does not know."""


def needs(module: str, package: str) -> Any:
    """Return a module of a neighbour's package, or skip the test."""
    return pytest.importorskip(module, reason=f"pip install {package}")


# OpenAI


def test_openai_s_types_accept_our_messages_and_the_door_theirs():
    union = needs("openai.types.realtime", "openai").RealtimeServerEvent
    types = {
        get_args(one.model_fields["type"].annotation)[0]: one
        for one in get_args(get_args(union)[0])
    }
    read = set(re.findall(r'"(\w+\.[\w.]+)"', inspect.getsource(openai_realtime.OpenAIRealtime)))
    assert read - set(BETA) <= set(types)
    for message, _ in conversation("openai"):
        if message["type"] not in BETA and message.get("delta", "") is not None:
            types[message["type"]].model_validate(message)
    for kind in types:
        openai_realtime.OpenAIRealtime().take(event(kind), 0.0)
        openai_realtime.OpenAIRealtime().take({"type": kind}, 0.0)


def test_openai_s_client_talks_through_the_relay():
    openai = needs("openai", "openai 'openai[realtime]'")
    port, bind = free_port(), f"127.0.0.1:{free_port()}"
    seen: list[Any] = []
    answer = [
        event("session.created"),
        event("response.created"),
        audio(0.2),
        event("response.output_audio.done"),
        event("response.done"),
    ]

    async def server(request: web.Request) -> web.WebSocketResponse:
        seen.append((str(request.rel_url), request.headers["Authorization"]))
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        async for message in socket:
            seen.append(message.json()["type"])
            for one in answer:
                await socket.send_json(one)
        return socket

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        client = openai.AsyncOpenAI(api_key="hush", websocket_base_url=f"ws://{bind}/v1")
        async with (
            realtime_server(port, server),
            client.realtime.connect(model="m") as program,
        ):
            await program.response.create()
            kinds = [(await program.recv()).type for _ in answer]
            assert kinds == [one["type"] for one in answer]
            await head.reaches("listening")
            assert "speaking" in head.states
        await head.reaches("idle")

    run(openai_realtime.DOOR, scenario, f"ws://127.0.0.1:{port}", bind)
    assert seen == [("/v1/realtime?model=m", "Bearer hush"), "response.create"]
