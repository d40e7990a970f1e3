"""Doors: the messages of each neighbour as orders, and what a bad neighbour does not do."""

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from aiohttp import ClientSession, WSServerHandshakeError, web
from command_line import invoked
from fakes.neighbours import (
    LVA,
    MAKERS,
    OAI,
    RTVI,
    agent,
    audio,
    conversation,
    event,
    realtime_server,
    rtvi,
    run,
)
from fakes.talking_head import TalkingHead, until
from fakes.voice_assistant import Assistant, free_port, lva

pytest.importorskip("gazerig.doors", reason="the folder doors was removed")


import gazerig
from gazerig.doors import admission, livekit, openai_realtime, pipecat, voice_assistant, wyoming
from gazerig.doors.door import Address, Door, DoorLink
from gazerig.doors.turn_taking import Orders, UnknownMessage
from gazerig.drivers.plugins import DOOR, SHIPPED, find
from gazerig.robot.run.doors import load_door


def brief(orders: Orders) -> list[Any]:
    """Return orders as names; those of speech with their known duration or the text's length."""
    return [
        (o.state, o.seconds) if o.seconds is not None
        else (o.state, f"{len(o.text)} characters") if o.text else o.state
        for o in orders
    ]  # fmt: skip


SAID = "Sure, I have set a timer of 5 minutes for the eggs in your kitchen."  # 67 characters


@pytest.mark.parametrize("name", MAKERS)
def test_messages_become_orders(name: str):
    messages, door = conversation(name), MAKERS[name][0]()
    assert [brief(door.take(message, 10.0)) for message, _ in messages] == [
        orders for _, orders in messages
    ]


@pytest.mark.parametrize(
    ("make", "message", "remedy"),
    [
        (LVA, {"event": "sing"}, "check that the address"),
        (LVA, {}, "check that the address"),
        (RTVI, {"type": "bot-started-speaking"}, "forward the RTVI messages"),
    ],
)
def test_a_message_of_another_version_is_named(
    make: Callable[[], Any], message: Mapping[str, Any], remedy: str
):
    door = make()
    with pytest.raises(UnknownMessage, match=remedy):
        door.take(message, 0.0)
    assert door.talk.state == "idle"


def test_played_speech_ends_by_its_length():
    door = OAI()
    for message in (event("response.created"), audio(2.0), event("response.output_audio.done")):
        door.take(message, 5.0)
    assert door.due(8.0) == ()  # the answer may continue
    door.take(event("response.done"), 5.2)
    assert door.due(6.9) == () and brief(door.due(7.1)) == ["listening"] and door.due(9.0) == ()


# A neighbour on this computer


def test_a_voice_assistant_is_followed_and_found_again():
    """It is not there at first; it sends nonsense, a flood, and closes; it returns."""
    assistant = Assistant()

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        assert "waiting for a Linux Voice Assistant at ws" in head.said[0]
        async with assistant:
            await until(lambda: assistant.sockets)
            await assistant.send(lva("wake_word_detected"))
            await until(lambda: head.states == ["listening"])
            await assistant.send("{not JSON", "[1]", "[1]", lva("sing"), lva("sing"))
            await assistant.send(*([lva("thinking"), lva("listening")] * 400), lva("thinking"))
            await until(lambda: head.last == "thinking" and len(head.orders) > 2)
            await assistant.sockets[-1].close()
            await until(lambda: head.last == "idle" and len(assistant.sockets) == 2)
            await assistant.send(lva("listening"))
            await head.reaches("listening")

    head = run(voice_assistant.DOOR, scenario, f"ws://127.0.0.1:{assistant.port}")
    assert len(head.orders) < 200  # of 801: the newest ones
    for words in (
        "not a JSON object (Exp",
        "expected an object",
        "'sing'",
        "500 messages a second",
    ):
        assert sum(words in line for line in head.said) == 1, head.said


@pytest.mark.parametrize("door", [pipecat.DOOR, openai_realtime.DOOR], ids=lambda one: one.name)
def test_web_pages_are_refused_and_programs_are_not(door: Door):
    """Also a page of this computer, a page in a frame without an address, and a rebound name."""
    port = free_port()
    refused: list[dict[str, str]] = [
        {"Origin": origin}
        for origin in (
            "null", "file://", "", "http://localhost:5173", "http://localhost", "https://a.example",
            f"https://127.0.0.1:{port}", f"http://127.0.0.1:{port}.a.example",
            f"http://a.example:{port}",
        )
    ]  # fmt: skip
    hosts = (f"a.example:{port}", f"127.0.0.1.a.example:{port}", "[", "")
    refused += [{"Host": host} for host in hosts]
    programs = [{}, {"Origin": f"http://localhost:{port}"}, {"Host": f"localhost:{port}"}]
    programs += [{"Host": "[::1]:22"}]  # through a tunnel

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        async with ClientSession() as session:
            for headers in refused:
                with pytest.raises(WSServerHandshakeError, match="403"):
                    await session.ws_connect(f"ws://127.0.0.1:{port}/v1", headers=headers)
            for headers in programs:
                try:
                    await session.ws_connect(f"ws://127.0.0.1:{port}/v1", headers=headers)
                except WSServerHandshakeError as error:  # there is no server behind the relay
                    assert (error.status, door.name) == (502, "openai-realtime")
            async with session.get(f"http://127.0.0.1:{port}/v1") as answer:  # a page's picture
                assert answer.status == 426
        assert len([line for line in head.said if "was refused" in line]) == len(refused)
        assert any("a web page of null was refused; let a program" in line for line in head.said)

    run(door, scenario, "ws://127.0.0.1:9", f"127.0.0.1:{port}")


def open_as_a_stranger(port: int, monkeypatch: pytest.MonkeyPatch) -> socket.socket:
    """Connect as another user than the door's."""
    if os.getuid() != 0:
        monkeypatch.setattr(os, "getuid", lambda: 4_000_000)
        return socket.create_connection(("127.0.0.1", port))
    os.seteuid(4_000_000)  # a socket is of the user that makes it
    try:
        one = socket.socket()
    finally:
        os.seteuid(0)
    one.connect(("127.0.0.1", port))
    return one


@pytest.mark.parametrize("door", [pipecat.DOOR, wyoming.DOOR], ids=lambda one: one.name)
def test_another_user_of_this_computer_cannot_speak(door: Door, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("wyoming", reason="it is in the extra doors")
    port = free_port()
    request = (
        f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        stranger = open_as_a_stranger(port, monkeypatch)
        reader, writer = await asyncio.open_connection(sock=stranger)
        if door is pipecat.DOOR:
            writer.write(request.encode())
        await until(lambda: any("a program of user " in line for line in head.said))
        await reader.readuntil(b"was refused; run it as the door's user")
        writer.close()

    run(door, scenario, bind=f"127.0.0.1:{port}")


def test_realtime_sessions_are_relayed_with_their_key():
    """The server sees the program's key and question; the program, the server's events."""
    port, bind = free_port(), f"127.0.0.1:{free_port()}"
    seen: list[Any] = []
    sockets: list[web.WebSocketResponse] = []

    async def server(request: web.Request) -> web.WebSocketResponse:
        seen.append((str(request.rel_url), request.headers["Authorization"]))
        socket = web.WebSocketResponse(protocols=("realtime",))
        await socket.prepare(request)
        sockets.append(socket)
        async for message in socket:
            seen.append(message.data)
        return socket

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        url, key = f"ws://{bind}/v1/realtime?model=m", {"Authorization": "Bearer hush"}
        async with ClientSession() as session:
            with pytest.raises(WSServerHandshakeError, match="502"):
                await session.ws_connect(url, headers=key)
            async with realtime_server(port, server):
                program = await session.ws_connect(url, headers=key, protocols=("realtime",))
                assert program.protocol == "realtime"
                await program.send_str("hello")
                await until(lambda: "hello" in seen)
                for one in (event("input_audio_buffer.speech_started"), audio(0.1)):
                    await sockets[0].send_json(one)
                await sockets[0].send_str("no JSON")
                kinds = [(await program.receive_json())["type"] for _ in range(2)]
                assert kinds[1] == audio(0)["type"]
                assert (await program.receive()).data == "no JSON"
                await head.reaches("speaking")
                await sockets[0].send_json(event("response.output_audio.done"))
                await sockets[0].send_json(event("response.done"))
                await head.reaches("listening")
                assert head.mouths == [(24_000, 1, bytes(4800))] and not head.sounds
                await sockets[0].close(code=4000)
                while not program.closed:
                    await program.receive()
                assert program.close_code == 4000
                await head.reaches("idle")

    head = run(openai_realtime.DOOR, scenario, f"ws://127.0.0.1:{port}", bind)
    assert seen == [("/v1/realtime?model=m", "Bearer hush"), "hello"]
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

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
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
            for one in (AudioStart(**shape), AudioChunk(**shape, audio=pcm), AudioStop()):
                await sounds.write_event(one.event())
            answer = await sounds.read_event()
            assert answer is not None and Played.is_type(answer.type)
            await head.reaches("idle")
            # The first one opens the loudspeaker.
            assert head.sounds == [(16000, 1, bytes(1280)), (16000, 1, pcm)]
            assert any(order[:2] == ("speaking", 0.4) for order in head.orders), head.orders
            # A long sound is interrupted: most of it is never said.
            await sounds.write_event(AudioStart(**shape).event())
            await sounds.write_event(AudioChunk(**shape, audio=bytes(960_000)).event())
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
     b'{"type": "audio-chunk", "payload_length": 99999999999}\n',
     b'{"type": "audio-start", "data": {"rate": 0, "width": 2, "channels": 1}}\n',
     b'{"type": "audio-chunk", "data": {"rate": 8000, "width": 2, "channels": 1},'
     b' "payload_length": 1}\nx'],
)  # fmt: skip
def test_a_stranger_at_the_satellite_s_port_is_disconnected(sent: bytes):
    pytest.importorskip("wyoming", reason="it is in the extra doors")
    port = free_port()

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(sent)
        assert await reader.read() == b""
        writer.close()
        await until(lambda: len(head.said) == 2)
        assert "no Wyoming event" in head.said[1] and "check the neighbour" in head.said[1]

    run(wyoming.DOOR, scenario, bind=f"127.0.0.1:{port}")


# A room of LiveKit


class Emitter:
    """Calls what was registered, as livekit.rtc.EventEmitter does."""

    def __init__(self) -> None:
        self.handlers: dict[str, Callable[..., object]] = {}
        self.remote_participants: dict[str, Any] = {}
        self.joined: tuple[str, ...] = ()

    def on(self, name: str, handler: Callable[..., object]) -> None:
        self.handlers[name] = handler

    async def connect(self, *joined: str) -> None:
        self.joined = joined

    async def disconnect(self) -> None:
        self.joined = ()


def test_an_agent_in_a_room_steers_the_head():
    head, room = TalkingHead(), Emitter()

    subscribed: list[bool] = []

    async def stream(part: Any) -> AsyncIterator[Any]:
        yield part

    async def scenario() -> None:
        link = DoorLink(head.connect, head.said.append, "ws://room")
        running = asyncio.ensure_future(link.run())
        sound = SimpleNamespace(kind=1, subscribed=False, set_subscribed=subscribed.append)
        known = SimpleNamespace(attributes=agent("thinking"), track_publications={"s": sound})
        room.remote_participants = {"a": known}
        work = livekit.follow_room(link, room, "token", "options", lambda track: stream(track))
        following = asyncio.ensure_future(work)
        await until(lambda: head.states == ["thinking"])
        assert room.joined == ("ws://room", "token", "options") and subscribed == [True]
        room.handlers["participant_attributes_changed"](agent("speaking"), None)
        await head.reaches("speaking")
        room.handlers["track_subscribed"](bytes(640), sound, known)
        await asyncio.sleep(0.05)  # the samples are read
        room.handlers["participant_disconnected"](SimpleNamespace(attributes=agent("speaking")))
        await head.reaches("idle")
        room.handlers["disconnected"]("closed")
        await following
        running.cancel()

    asyncio.run(scenario())
    assert head.mouths == [(16_000, 1, bytes(640))] and "speech" in head.ended_tracks
    assert room.joined == () and not any("token" in line for line in head.said)


def test_a_room_needs_an_address_and_a_token(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("LIVEKIT_URL", raising=False)
    link = DoorLink(lambda: None, print)
    with pytest.raises(gazerig.Error, match="set LIVEKIT_URL"):
        asyncio.run(livekit.serve(link))


# All doors


def test_doors_listen_on_this_computer_unless_told_otherwise():
    for name in SHIPPED[DOOR]:
        door = find(DOOR, name).load()
        assert isinstance(door, Door) and door.summary
        assert not door.bind or Address.parse(door.bind).host == "127.0.0.1"


@pytest.mark.parametrize("bind", ["6055", "host:99999", ":80"])
def test_a_wrong_address_is_named(bind: str):
    with pytest.raises(gazerig.Error, match="is not HOST:PORT"):
        Address.parse(bind)


def test_a_door_names_who_can_reach_it_and_a_port_that_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))

    async def serve(link: DoorLink) -> None:
        link.report(f"{link.address} {link.bind}")

    said: list[str] = []
    Door("x", serve, "a neighbour", "ws://a", "127.0.0.1:1").run(say=said.append)
    assert "ws://a 127.0.0.1:1" in said and "steer" not in said[0]
    said.clear()
    Door("x", serve, "a neighbour", "ws://a").run(address="ws://b", bind="[::]:1", say=said.append)
    assert "every program on this network can steer" in said[0] and "ws://b [::]:1" in said
    for name in ("pipecat", "wyoming"):
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            one.listen()
            port = one.getsockname()[1]
            with pytest.raises(gazerig.Error, match=f"cannot listen on 127.0.0.1:{port}: "):
                load_door(name).run(bind=f"127.0.0.1:{port}", say=said.append)
    with pytest.raises(gazerig.Error, match="'6055' is not ws://HOST:PORT"):
        voice_assistant.DOOR.run(address="6055", say=said.append)


def test_the_command_lists_doors_and_names_a_missing_one():
    assert invoked("door").out.count("\n") == len(SHIPPED[DOOR])
    missed = invoked("door", "wyomin")
    assert missed.code == 2
    assert "no door 'wyomin'; did you mean 'wyoming'?" in missed.err


def test_a_ninth_neighbour_is_refused_until_another_leaves():
    bind = f"127.0.0.1:{free_port()}"

    async def scenario(link: DoorLink, head: TalkingHead) -> None:
        async with ClientSession() as session:
            sockets = [await session.ws_connect(f"ws://{bind}/x?y=1") for _ in range(8)]
            with pytest.raises(WSServerHandshakeError, match="503"):
                await session.ws_connect(f"ws://{bind}")
            await sockets[0].close()
            newest = await session.ws_connect(f"ws://{bind}")
            await newest.send_json(rtvi("bot-started-speaking"))
            await head.reaches("speaking")

    head = run(pipecat.DOOR, scenario, bind=bind)
    assert "more than 8 connections at once: the newest is refused" in head.said


def test_the_user_of_a_connection_is_read_from_the_system_s_table(tmp_path: Path):
    heading, mapped = "sl local_address rem_address", "0000000000000000FFFF0000"
    # A server's end, the ends of two programs, one of them on IPv6, and one that has closed.
    (tmp_path / "tcp").write_text(
        f"""{heading} st tx_queue tr when retrnsmt uid timeout inode
        0: 0100007F:17A8 0100007F:C635 01 0:0 00:0 0 7 0 11 1
        1: 0100007F:C635 0100007F:17A8 01 0:0 00:0 0 1000 0 12 1
        2: 0100007F:C637 0100007F:17A8 05 0:0 03:1 0 0 0 0 3
        """.rstrip()
    )
    (tmp_path / "tcp6").write_text(
        f"""{heading} st tx_queue tr when retrnsmt uid timeout inode
        0: {mapped}0100007F:C636 {mapped}0100007F:17A8 01 0:0 00:0 0 1001 0 13 1
        1: {"0" * 24}01000000:C638 {"0" * 24}01000000:17A8 01 0:0 00:0 0 1002 0 14 1"""
    )
    users = {0xC635: {1000}, 0xC636: {1001}, 0xC637: set(), 0xC638: {1002}, 0xC639: set()}
    for port, wanted in users.items():
        assert admission.connection_users(tmp_path, port, 0x17A8) == wanted
