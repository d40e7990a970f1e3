"""One client of the page's websocket: what is dropped, refused and carried out of its messages."""

import asyncio
import json
import socket
from types import SimpleNamespace
from typing import Any

import aiohttp

from gazerig.robot.dashboard.door import page_door
from gazerig.robot.dashboard.door.client_socket import ClientSocket, Visitor, Wishes


def client(rate_hz: float = 0.0) -> ClientSocket:
    return ClientSocket(Wishes(rate_hz), Visitor("", "127.0.0.1"), "websocket 1")


def test_a_stop_in_the_buffer_of_a_connection_that_is_closed_is_carried_out(monkeypatch):
    """It is read late: the computer is busy, and much was sent before it."""
    monkeypatch.setattr(page_door, "REST_S", 0.02)
    stop = aiohttp.WSMessage(aiohttp.WSMsgType.TEXT, '{"do": "stop"}', None)
    end = aiohttp.WSMessage(aiohttp.WSMsgType.CLOSED, None, None)
    carried_out: list[object] = []

    async def carry_out(frame: object, *rest: object, late: bool) -> None:
        carried_out.append(frame)

    async def receive(sends: socket.socket) -> None:
        due_s, frames = asyncio.get_running_loop().time() + 0.07, iter((stop, end))

        async def next_frame() -> aiohttp.WSMessage:
            await asyncio.sleep(due_s - asyncio.get_running_loop().time())
            return next(frames)

        excess = page_door.ExcessCount()
        excess.is_over = True
        door = SimpleNamespace(_take_frame=carry_out)
        request = SimpleNamespace(transport=SimpleNamespace(get_extra_info=lambda name: sends))
        web_socket: Any = SimpleNamespace(receive=next_frame)
        arguments: Any = (door, web_socket, client(), request, excess)
        await page_door.PageDoor._receive(*arguments)

    here, there = socket.socketpair()
    with here, there:
        asyncio.run(receive(here))
        assert carried_out == []  # nothing waits in the kernel
        there.sendall(b"more")
        asyncio.run(receive(here))
    assert carried_out == [stop]


def test_messages_that_are_dropped_are_refused_together():
    async def drop() -> list[Any]:
        program = client()
        for _ in range(3):
            program.drop_message()
        await program.news.wait()
        return [json.loads(str(text)) for text in iter(program.outgoing, "")]

    (refusal,) = asyncio.run(drop())
    assert "too many requests" in refusal["refused"] and refusal["messages"] == 3


def test_commands_that_wait_are_refused_by_a_stop_and_questions_are_not():
    async def stop() -> list[Any]:
        program = client()
        for message in ({"do": "resume", "tag": 1}, {"do": "status"}, {"do": "look_at"}):
            program.orders.put_nowait(message)
        program.refuse_commands()
        said = [json.loads(str(text)) for text in iter(program.outgoing, "")]
        return [*said, program.orders.get_nowait(), program.orders.empty()]

    refused = {"refused": "it has been stopped meanwhile"}
    assert asyncio.run(stop()) == [{**refused, "tag": 1}, refused, {"do": "status"}, True]


def test_states_after_an_answer_are_not_older():
    async def follow() -> list[Any]:
        program, done = client(25.0), {"reply": {"t_s": 5.02}}
        program.add_state('"before"', 1.0)
        sent = [program.outgoing()]
        program.add_state('"older, and not read yet"', 2.0)
        program.queue_answer({"do": "look_at", "who": ""}, {"ok": done})
        sent += [*iter(program.outgoing, "")]
        wanted = [program.wants_state(t_s, 3.0) for t_s in (5.019, 5.02)]
        return [*(json.loads(str(text)) for text in sent), wanted]

    assert asyncio.run(follow()) == ["before", {"ok": {"reply": {"t_s": 5.02}}}, [False, True]]
