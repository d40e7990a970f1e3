"""Doors: the messages of each neighbour as orders, and what a bad neighbour does not do."""

import asyncio
import re
import socket
from types import SimpleNamespace

import pytest
from aiohttp import ClientSession, WSServerHandshakeError
from command_line import invoked
from fakes.neighbours import (
    MAKERS,
    RealtimeServer,
    audio,
    conversation,
    event,
    run,
    talk_in_a_room,
)
from fakes.talking_head import until
from fakes.voice_assistant import Assistant, free_port, lva

pytest.importorskip("gazerig.doors", reason="the folder doors was removed")

import gazerig
from gazerig.doors import livekit, openai_realtime, pipecat, voice_assistant, wyoming
from gazerig.doors.door import Address, Door, DoorLink
from gazerig.drivers.plugins import DOOR, SHIPPED, find
from gazerig.robot.run.doors import load_door


def brief(orders):
    """Return orders as names; those of speech with their known duration or the text's length."""
    return [
        (o.state, o.seconds) if o.seconds is not None
        else (o.state, f"{len(o.text)} characters") if o.text else o.state
        for o in orders
    ]  # fmt: skip


@pytest.mark.parametrize("name", MAKERS)
def test_messages_become_orders(name):
    messages, door = conversation(name), MAKERS[name][0]()
    assert [brief(door.take(message, 10.0)) for message, _ in messages] == [
        orders for _, orders in messages
    ]


def test_played_speech_ends_by_its_length():
    door = openai_realtime.OpenAIRealtime()
    for message in (event("response.created"), audio(2.0), event("response.output_audio.done")):
        door.take(message, 5.0)
    assert door.due(8.0) == ()  # the answer may continue
    door.take(event("response.done"), 5.2)
    assert door.due(6.9) == () and brief(door.due(7.1)) == ["listening"] and door.due(9.0) == ()


# A neighbour on this computer


def test_a_voice_assistant_is_followed_and_found_again(monkeypatch):
    """It is not there at first; it sends nonsense, a flood, and closes; it returns."""
    monkeypatch.setattr("gazerig.doors.door.FIRST_WAIT_S", 0.1)
    assistant = Assistant()

    async def scenario(link, head):
        assert re.match("waiting for a Linux Voice Assistant at ws.*: .* failed", head.said[0])
        async with assistant:
            await until(lambda: assistant.sockets)
            await assistant.send(lva("wake_word_detected"))
            await until(lambda: head.states == ["listening"])
            await assistant.send("{not JSON", "[1]", "[1]", {"sing": 1}, {"sing": 1})
            await assistant.send(*([lva("thinking"), lva("listening")] * 400), lva("thinking"))
            await head.reaches("thinking")
            await assistant.sockets[-1].close()
            await until(lambda: head.last == "idle" and len(assistant.sockets) == 2)
            await assistant.send(lva("listening"))
            await head.reaches("listening")

    head = run(voice_assistant.DOOR, scenario, f"ws://127.0.0.1:{assistant.port}")
    assert len(head.orders) < 200  # of 804: the newest ones
    for words in ("not a JSON object (Exp", "expected an object", "without an event"):
        assert sum(words in line for line in head.said) == 1, head.said


def test_web_pages_are_refused_and_programs_are_not():
    """Also a page of this computer, and a page in a frame without an address."""
    port = free_port()
    refused = (
        "null", "file://", "", "http://localhost", "https://a.example", f"https://127.0.0.1:{port}",
        f"http://127.0.0.1:{port}.a.example", f"http://a.example:{port}",
    )  # fmt: skip

    async def scenario(link, head):
        async with ClientSession() as session:
            for origin in refused:
                with pytest.raises(WSServerHandshakeError, match="403"):
                    await session.ws_connect(f"ws://127.0.0.1:{port}", headers={"Origin": origin})
            for own in ({}, {"Origin": f"http://localhost:{port}"}):
                await session.ws_connect(f"ws://127.0.0.1:{port}", headers=own)
            async with session.get(f"http://127.0.0.1:{port}") as answer:  # a page's picture
                assert answer.status == 400
        assert len([line for line in head.said if "was refused; let" in line]) == len(refused)

    run(pipecat.DOOR, scenario, bind=f"127.0.0.1:{port}")


def test_realtime_sessions_are_relayed_with_their_key():
    """The server sees the program's key and question; the program, the server's events."""
    server, bind = RealtimeServer(event("session.created")), f"127.0.0.1:{free_port()}"

    async def scenario(link, head):
        url, key = f"ws://{bind}/v1/realtime?model=m", {"Authorization": "Bearer hush"}
        async with ClientSession() as session:
            with pytest.raises(WSServerHandshakeError, match="502"):
                await session.ws_connect(url, headers=key)
            async with server:
                program = await session.ws_connect(url, headers=key)
                await program.send_json("hello")
                await until(lambda: server.received == ["hello"])
                await server.socket.send_str("no JSON")
                await server.socket.send_json(audio(0.1))
                assert (await program.receive_json())["type"] == "session.created"
                assert (await program.receive()).data == "no JSON"
                assert (await program.receive_json())["type"] == audio(0)["type"]
                await head.reaches("speaking")
                await server.socket.send_json(event("response.output_audio.done"))
                await server.socket.send_json(event("response.done"))
                await head.reaches("listening")
                assert head.mouths == [(24_000, 1, bytes(4800))] and not head.sounds
                await server.socket.send_json(audio(60.0))
                await head.reaches("speaking")
                await server.socket.send_json(event("input_audio_buffer.speech_started"))
                await until(lambda: head.ended_tracks == ["speech"])  # an interruption
                await server.socket.send_json(audio(60.0))
                await head.reaches("speaking")
                await server.socket.close(code=4000)
                while not program.closed:
                    await program.receive()
                assert program.close_code == 4000
                await head.reaches("idle")
                await until(lambda: len(head.ended_tracks) == 2)

    head = run(openai_realtime.DOOR, scenario, f"ws://127.0.0.1:{server.port}", bind)
    assert server.asked == ("/v1/realtime?model=m", "Bearer hush")
    assert not any("hush" in line for line in head.said)


def test_a_satellite_s_sound_is_said_and_reported_as_played():
    """The package wyoming is the judge: it writes and reads what the door reads and writes."""
    pytest.importorskip("wyoming", reason="it is in the extra doors")
    from wyoming.audio import AudioChunk, AudioStart, AudioStop
    from wyoming.client import AsyncTcpClient
    from wyoming.info import Describe, Info
    from wyoming.ping import Ping, Pong
    from wyoming.snd import Played
    from wyoming.vad import VoiceStarted
    from wyoming.wake import Detection

    port = free_port()
    pcm = bytes(range(256)) * 50  # .4 s
    shape = {"rate": 16000, "width": 2, "channels": 1}

    async def play(client, pcm, *end):
        for one in (AudioStart(**shape), AudioChunk(**shape, audio=pcm), *end):
            await client.write_event(one.event())

    async def scenario(link, head):
        async with (
            AsyncTcpClient("127.0.0.1", port) as sounds, AsyncTcpClient("127.0.0.1", port) as events
        ):  # fmt: skip
            await sounds.write_event(Describe().event())
            answer = await sounds.read_event()
            assert answer is not None and [one.name for one in Info.from_event(answer).snd]
            await sounds.write_event(Ping(text="x").event())
            answer = await sounds.read_event()
            assert answer is not None and Pong.from_event(answer).text == "x"
            await events.write_event(Detection(name="hey").event())
            await until(lambda: head.states == ["listening"])
            await play(sounds, pcm, AudioStop())
            answer = await sounds.read_event()
            assert answer is not None and Played.is_type(answer.type)
            await head.reaches("idle")
            async with AsyncTcpClient("127.0.0.1", port) as more:
                await play(more, pcm, AudioStop())
                await head.reaches("speaking")
            await head.reaches("idle")  # though it has left before the sound was heard
            del head.sounds[-1]
            # The first one opens the loudspeaker.
            assert head.sounds == [(16000, 1, bytes(1280)), (16000, 1, pcm)]
            assert any(order[:2] == ("speaking", 0.4) for order in head.orders), head.orders
            # A long sound is interrupted: most of it is never said.
            await play(sounds, bytes(960_000))
            await head.reaches("speaking")
            await events.write_event(VoiceStarted().event())
            await until(lambda: "interrupt" in head.states)
            await until(lambda: head.ended_tracks == ["speech"])  # and is silent at once
        await head.reaches("idle")

    head = run(wyoming.DOOR, scenario, bind=f"127.0.0.1:{port}")
    assert len(head.sounds) == 3 and len(head.sounds[2][2]) < 960_000


@pytest.mark.parametrize(
    "sent",
    [b"GET / HTTP/1.1\r\n\r\n", b"x" * 100_000,
     b'{"type": "audio-chunk", "data": {"rate": 0, "width": 2, "channels": 1},'
     b' "payload_length": 2}\nxx'],
)  # fmt: skip
def test_a_stranger_at_the_satellite_s_port_is_disconnected(sent):
    pytest.importorskip("wyoming", reason="it is in the extra doors")
    port = free_port()

    async def scenario(link, head):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(sent)
        assert await reader.read() == b""
        writer.close()
        await until(lambda: len(head.said) == 2)
        assert "no Wyoming event" in head.said[1] and "check the neighbour" in head.said[1]

    run(wyoming.DOOR, scenario, bind=f"127.0.0.1:{port}")


# A room of LiveKit


def test_an_agent_in_a_room_steers_the_head_and_is_told_who_addresses_it():
    calls: list[str] = []

    async def perform_rpc(*, destination_identity, method, payload):
        calls.append(f"{destination_identity} {method}")
        if method == "end_turn":
            raise RuntimeError("Method not supported at destination")
        return ""

    head = talk_in_a_room(SimpleNamespace(perform_rpc=perform_rpc), calls)
    names = ("cancel", "start", "end", "start", "cancel", "start")
    assert calls == [f"agent {name}_turn" for name in names]
    assert sum("register start_turn, end_turn and cancel_turn" in line for line in head.said) == 1


def test_a_room_needs_an_address_and_a_token(monkeypatch):
    monkeypatch.delenv("LIVEKIT_URL", raising=False)
    link = DoorLink(lambda: None, print)
    with pytest.raises(gazerig.Error, match="set LIVEKIT_URL"):
        asyncio.run(livekit.serve(link))


# All doors


def test_doors_listen_on_this_computer_unless_told_otherwise():
    for bind in ("6055", "host:99999", ":80"):
        with pytest.raises(gazerig.Error, match="is not HOST:PORT"):
            Address.parse(bind)
    for name in SHIPPED[DOOR]:
        door = find(DOOR, name).load()
        assert isinstance(door, Door) and door.summary
        assert not door.bind or Address.parse(door.bind).host == "127.0.0.1"


def test_a_door_names_who_can_reach_it_and_a_port_that_is_taken(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))

    async def serve(link):
        link.report(f"{link.address} {link.bind}")

    said: list[str] = []
    Door("x", serve, "a neighbour", "ws://a", "127.0.0.1:1").run(say=said.append)
    assert "ws://a 127.0.0.1:1" in said and "steer" not in said[0]
    said.clear()
    Door("x", serve, "a neighbour", "ws://a").run(address="ws://b", bind="[::]:1", say=said.append)
    assert "every program on this network can steer" in said[0] and "ws://b [::]:1" in said
    with socket.create_server(("127.0.0.1", 0)) as one:
        bind = f"127.0.0.1:{one.getsockname()[1]}"
        for name in ("pipecat", "wyoming"):
            with pytest.raises(gazerig.Error, match=f"cannot listen on {bind}: "):
                load_door(name).run(bind=bind, say=said.append)
    with pytest.raises(gazerig.Error, match="'6055' is not ws://HOST:PORT"):
        voice_assistant.DOOR.run(address="6055", say=said.append)


def test_the_command_lists_doors_and_names_a_missing_one():
    assert invoked("door").out.count("\n") == len(SHIPPED[DOOR])
    missed = invoked("door", "wyomin")
    assert missed.code == 2
    assert "no door 'wyomin'; did you mean 'wyoming'?" in missed.err
