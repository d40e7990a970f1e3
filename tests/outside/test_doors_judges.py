"""Doors and the packages of their neighbours, which write and read what the doors read and write.

The packages are large, and their users have them: without one, its tests are skipped.
"""

import asyncio
import inspect
import re
from typing import Any, get_args

import pytest
from fakes.neighbours import RealtimeServer, conversation, event, run, talk_in_a_room
from fakes.talking_head import TalkingHead, until
from fakes.voice_assistant import free_port

pytest.importorskip("gazerig.doors", reason="the folder doors was removed")

from gazerig.doors import openai_realtime, pipecat
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
    sent = {"session.update", "input_audio_buffer.clear"}
    assert read - sent - set(BETA) <= set(types)
    for message, _ in conversation("openai"):
        if message["type"] not in BETA and message.get("delta", "") is not None:
            types[message["type"]].model_validate(message)
    for kind in types:
        openai_realtime.OpenAIRealtime().take(event(kind), 0.0)
        openai_realtime.OpenAIRealtime().take({"type": kind}, 0.0)


def test_openai_s_types_accept_how_turns_are_detected():
    kinds = needs("openai.types.realtime", "openai")
    door = openai_realtime.OpenAIRealtime()
    detection = {"turn_detection": {"type": "semantic_vad", "eagerness": "low"}}
    created = event("session.created", session={"type": "realtime", "audio": {"input": detection}})
    kinds.SessionCreatedEvent.model_validate(created)
    door.take(created, 0.0)
    (off,), (clear, on) = door.detect_turns(False), door.detect_turns(True)
    kinds.InputAudioBufferClearEvent.model_validate(clear)
    for message in (off, on):
        update = kinds.SessionUpdateEvent.model_validate(message)
        assert update.session.audio.input.model_fields_set == {"turn_detection"}


def test_openai_s_client_talks_through_the_relay():
    openai = needs("openai", "openai 'openai[realtime]'")
    kinds = ("session.created", "response.created", "response.output_audio.done", "response.done")
    server, bind = RealtimeServer(*map(event, kinds)), f"127.0.0.1:{free_port()}"

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        client = openai.AsyncOpenAI(api_key="hush", websocket_base_url=f"ws://{bind}/v1")
        async with server, client.realtime.connect(model="m") as program:
            await program.response.create()
            assert [(await program.recv()).type for _ in kinds] == list(kinds)
            await until(lambda: server.received == [{"type": "response.create"}])

    run(openai_realtime.DOOR, scenario, f"ws://127.0.0.1:{server.port}", bind)
    assert server.asked == ("/v1/realtime?model=m", "Bearer hush")


# Pipecat


def test_pipecat_s_processor_passes_our_message_to_the_bot():
    needs("pipecat", "pipecat-ai")
    from pipecat.processors.frameworks.rtvi import RTVIProcessor
    from pipecat.processors.frameworks.rtvi import models as rtvi_models

    seen: list[Any] = []

    async def scenario() -> None:
        processor = RTVIProcessor()

        @processor.event_handler("on_client_message")
        async def on_client_message(processor: Any, message: Any) -> None:
            seen.append((message.type, message.data))

        message = rtvi_models.Message.model_validate(pipecat.Pipecat().addressed(3))
        await processor._handle_message(message)
        await asyncio.sleep(0.1)  # the handler is a task
        await processor.cleanup()

    asyncio.run(scenario())
    assert seen == [("addressed", {"person": 3})]


# LiveKit


def test_livekit_s_participants_carry_our_calls_to_an_agent():
    """All but the network is LiveKit's; the agent's methods are those of docs/talk.md."""
    rtc = needs("livekit.rtc", "livekit")
    ours, agents = (object.__new__(rtc.LocalParticipant) for _ in range(2))
    calls: list[str] = []
    names = ("start_turn", "end_turn", "cancel_turn")
    agents._rpc_handlers = dict.fromkeys(names, lambda call: calls.append(call.method))
    ours._rpc_interceptors = agents._rpc_interceptors = []

    async def carry(call: Any) -> str:
        invocation = rtc.RpcInvocationData("1", "head", call.payload, 5.0, method=call.method)
        answer = await agents._run_incoming_chain(invocation)
        return answer or ""

    ours._perform_rpc_ffi = carry
    talk_in_a_room(ours, calls)
    assert calls == [names[at] for at in (2, 0, 1, 0, 2, 0)]
