"""Doors of a running head: their processes begin and end with it, and none can harm it."""

import asyncio
import os
import re
import signal
import socket
import threading
from collections.abc import Iterator

import pytest
from fakes.voice_assistant import Assistant, free_port, lva
from fakes.waiting import wait_for
from slow_rigs import at_rate

pytest.importorskip("gazerig.doors", reason="the folder doors was removed")

import gazerig
from gazerig.robot.loop import client_control

pytestmark = [
    pytest.mark.usefixtures("ideal_servos"),
]


@pytest.fixture
def assistant() -> Iterator[Assistant]:
    """Serve a voice assistant in a thread."""
    one, begun, ended = Assistant(), threading.Event(), asyncio.Event()

    async def serve() -> None:
        async with one:
            one.loop = asyncio.get_running_loop()
            begun.set()
            await ended.wait()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    begun.wait()
    yield one
    one.loop.call_soon_threadsafe(ended.set)
    thread.join()


def does(head: gazerig.Head, state: str) -> bool:
    """Return whether a conversation has a state."""
    return head.state.conversation.state == state


def talking(head: gazerig.Head) -> int:
    """Return the process of the door whose conversation it is."""
    found = re.fullmatch(r"door voice-assistant \(process (\d+)\)", head.state.conversation.who)
    assert found is not None
    return int(found[1])


def test_doors_begin_and_end_with_the_head(assistant, tmp_path, monkeypatch):
    """STOP works meanwhile; a killed door costs its state after a second, and is reported."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    said: list[str] = []
    port = free_port()
    rig = at_rate(tmp_path, "desk", 80.0)
    with open(rig, "a") as file:
        file.write(
            f"doors:\n  voice-assistant: {{address: ws://127.0.0.1:{assistant.port}}}\n"
            f"  pipecat: {{bind: 127.0.0.1:{port}, addressed: true}}\n"
        )

    with gazerig.open(rig, mock=True, scene="face-to-face", say=said.append) as head:
        wait_for(lambda: assistant.sockets)
        wait_for(lambda: any("door pipecat: waiting for RTVI" in line for line in said))
        # On a busy computer a conversation may be renewed later than within a second.
        with monkeypatch.context() as patch:
            patch.setattr(client_control, "HEARTBEAT_S", 120.0)
            for event, state in (
                ("wake_word_detected", "listening"), ("thinking", "thinking"),
                ("tts_speaking", "speaking"), ("listening", "interrupted"), ("thinking", "thinking"),
            ):  # fmt: skip
                assistant.send_soon(lva(event))
                wait_for(lambda state=state: does(head, state))  # type: ignore[misc]
            first = talking(head)
            os.kill(first, signal.SIGKILL)
        wait_for(lambda: does(head, "idle"))
        wait_for(lambda: any("ends: not renewed" in line for line in said))
        head.stop("a hand")
        assert head.state.stopped == "a hand"
    assert any("voice-assistant: ended with code -9; the head continues" in line for line in said)
    assert re.fullmatch("stopped by the program: not parked.*, torque off", said[-1])
    with pytest.raises(ProcessLookupError):
        os.kill(first, 0)
    with socket.socket() as one:
        one.bind(("127.0.0.1", port))  # it is free again
    assert not [t for t in threading.enumerate() if t.name.startswith("door ")]
