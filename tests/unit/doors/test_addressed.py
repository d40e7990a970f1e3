"""A neighbour listens without a wake word: the doors tell it that a person addresses the head."""

import asyncio
from typing import Any

import pytest
from aiohttp import ClientSession
from fakes.neighbours import RealtimeServer, event, rtvi, run
from fakes.talking_head import until
from fakes.voice_assistant import Assistant, free_port, lva

pytest.importorskip("gazerig.doors", reason="the folder doors was removed")

from gazerig.doors import openai_realtime, pipecat, voice_assistant, wyoming


@pytest.fixture(autouse=True)
def look_often(monkeypatch):
    for name in ("FIRST_WAIT_S", "_WATCH_S", "_LOOK_S"):
        monkeypatch.setattr(f"gazerig.doors.door.{name}", 0.02)


@pytest.mark.parametrize("addressed", [True, False])
def test_a_voice_assistant_listens_when_the_head_does_not_speak(addressed):
    assistant = Assistant()

    async def scenario(link, head):
        async with assistant:
            await until(lambda: assistant.sockets)
            head.addressed_by = 3
            if not addressed:
                await head.is_looked_at()
                assert not assistant.commands
                return
            await until(lambda: assistant.commands == ["start_listening"])
            await assistant.send(lva("listening"), lva("tts_speaking"))
            await head.reaches("speaking")
            head.addressed_by = None
            await head.is_looked_at()
            head.addressed_by = 4  # it speaks
            await head.is_looked_at()
            assert len(assistant.commands) == 1
            await assistant.send(lva("tts_finished"))
            await until(lambda: assistant.commands == ["start_listening"] * 2)

    run(voice_assistant.DOOR, scenario, f"ws://127.0.0.1:{assistant.port}", addressed=addressed)


def test_a_satellite_detects_a_look_as_its_wake_word():
    """The package wyoming is the judge."""
    pytest.importorskip("wyoming", reason="it is in the extra doors")
    from wyoming.audio import AudioChunk, AudioStart, AudioStop
    from wyoming.client import AsyncTcpClient
    from wyoming.info import Describe, Info
    from wyoming.wake import Detect, Detection, NotDetected

    port = free_port()
    shape = {"rate": 16000, "width": 2, "channels": 1}

    async def scenario(link, head):
        async with AsyncTcpClient("127.0.0.1", port) as wake:

            async def read():
                answer = await asyncio.wait_for(wake.read_event(), 20.0)
                assert answer is not None
                return answer

            await wake.write_event(Describe().event())
            name = Info.from_event(await read()).wake[0].models[0].name
            for one in (
                Detect(names=[name]), AudioStart(**shape),
                AudioChunk(**shape, audio=bytes(640), timestamp=20),
            ):  # fmt: skip
                await wake.write_event(one.event())
            await head.is_looked_at()
            head.addressed_by = 3
            assert Detection.from_event(await read()) == Detection(name, 20)
            # The same look calls once.
            for again in (AudioStop(), Detect(names=[name]), AudioStart(**shape), AudioStop()):
                await wake.write_event(again.event())
            assert NotDetected.is_type((await read()).type)
            head.addressed_by = None
            await until(lambda: link.addressed_by is None)
            head.addressed_by = 3
            assert Detection.is_type((await read()).type)
        head.addressed_by = None
        await until(lambda: link.addressed_by is None)
        head.addressed_by = 5
        await until(lambda: link.addressed_by == 5)
        async with AsyncTcpClient("127.0.0.1", port) as wake:  # connected after the look began
            await wake.write_event(Detect().event())
            assert Detection.from_event(await read()).name == name
        assert all(len(sound[2]) == 1280 for sound in head.sounds)  # that which opens it

    run(wyoming.DOOR, scenario, bind=f"127.0.0.1:{port}", addressed=True)


def test_a_pipecat_client_receives_a_message_for_the_bot():
    bind = f"127.0.0.1:{free_port()}"

    async def scenario(link, head):
        async with ClientSession() as session:
            client = await session.ws_connect(f"ws://{bind}")
            first = await client.receive_json(timeout=20.0)
            assert {**first, "id": ""} == {
                "label": "rtvi-ai", "type": "client-message", "id": "",
                "data": {"t": "addressed", "d": {"person": None}},
            }  # fmt: skip
            head.addressed_by = 3
            assert (await client.receive_json(timeout=20.0))["data"]["d"] == {"person": 3}
            await client.send_json({"type": "bot-started-speaking"})  # it is no RTVI message
            await until(lambda: any("forward the RTVI messages" in line for line in head.said))
            await client.send_json(rtvi("bot-started-speaking"))
            second = await client.receive_json(timeout=20.0)
            assert second["data"]["d"] == {"person": None}

    run(pipecat.DOOR, scenario, bind=bind, addressed=True)


SEMANTIC = {"type": "semantic_vad", "eagerness": "low"}
CAREFUL = {"type": "server_vad", "interrupt_response": False}


@pytest.mark.parametrize("beta", [False, True])
def test_a_realtime_session_detects_turns_while_addressed(beta):
    """The program's own turn detection is kept, and a turn that was begun is heard to its end."""

    def update(detection, kind="session.update"):
        session: dict[str, Any] = {"turn_detection": detection}
        if not beta:
            session = {"type": "realtime", "audio": {"input": session}}
        return {"type": kind, "session": session}

    server, bind = RealtimeServer(update(SEMANTIC, "session.created")), f"127.0.0.1:{free_port()}"

    async def scenario(link, head):
        async def receives(*messages):
            await until(lambda: len(server.received) >= len(messages))
            assert server.received == list(messages)
            server.received.clear()

        async def receives_nothing():
            head.addressed_by = None
            await head.is_looked_at()
            await receives()

        opened = {"type": "input_audio_buffer.clear"}
        async with server, ClientSession() as client:
            program = await client.ws_connect(f"ws://{bind}/v1/realtime")
            await receives(update(None))
            head.addressed_by = 3
            await receives(opened, update(SEMANTIC))
            await server.socket.send_json(event("input_audio_buffer.speech_started"))
            await head.reaches("listening")
            await receives_nothing()  # the person speaks
            await server.socket.send_json(event("input_audio_buffer.speech_stopped"))
            await receives(update(None))
            await program.send_json(update(CAREFUL))
            await receives(update(CAREFUL), update(None))
            head.addressed_by = 3
            await receives(opened, update(CAREFUL))
            await server.socket.send_json(event("response.output_audio.delta", delta="AAAA"))
            await receives(update(None))  # it may not be interrupted
            await server.socket.send_json(event("output_audio_buffer.stopped"))
            await receives(opened, update(CAREFUL))
            await program.send_json(update(None))  # the program detects turns itself
            await receives(update(None))
            await receives_nothing()

    run(openai_realtime.DOOR, scenario, f"ws://127.0.0.1:{server.port}", bind, addressed=True)
