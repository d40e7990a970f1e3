"""Only allowed visitors enter: no other origin, no one without the token, no one by the back."""

import json
import os
import socket
import stat
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest
import viser
from page_at_the_door import (
    DONE,
    ELSEWHERE,
    OPENED,
    PATIENCE_S,
    SOCKET,
    TOKEN,
    Rig,
    answer_to,
    opened,
)
from page_visitor import VISER, fetch
from websockets.exceptions import ConnectionClosed, InvalidStatus

from gazerig.robot.dashboard.door.browsers import MOST as MOST_CONNECTIONS
from gazerig.robot.dashboard.door.page_door import MOST_CLIENTS
from gazerig.robot.dashboard.door.viser_server import FROM_BROWSER_BYTES


@pytest.fixture(scope="module")
def near() -> Iterator[Rig]:
    """A page for this machine alone."""
    with opened("127.0.0.1") as rig:
        yield rig


# --- on this machine ----------------------------------------------------------------------


def test_the_page_comes_with_its_stop_button(near):
    status, headers, text = near.get()
    assert status == 200 and 'src="/rig/stop.js"></script>' in text
    assert headers["X-Frame-Options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    status, headers, text = near.get("/rig/stop.js")
    assert status == 200 and "javascript" in headers["Content-Type"] and "STOP" in text


def test_the_view_is_viser_in_a_frame_of_this_page_alone(near):
    status, headers, text = near.get("/view/")
    assert (
        status == 200
        and '<link rel="stylesheet" href="/rig/view.css"><script src="/rig/view.js"></script></head>'
        in text
    )
    assert headers["X-Frame-Options"] == "SAMEORIGIN"
    assert headers["Content-Security-Policy"] == "frame-ancestors 'self'"
    status, headers, _ = near.get("/view")
    assert (status, headers["Location"]) == (302, "/view/")
    assert near.get("/elsewhere")[0] == near.get("/rig/page_files.py")[0] == 404


@pytest.mark.parametrize("host", ["elsewhere.example", "127.0.0.1.elsewhere.example", "10.0.0.1"])
def test_a_foreign_name_for_this_machine_is_refused(near, host):
    status, _, text = near.get(Host=host)
    assert status == 403 and text.startswith("refused") and len(text.splitlines()) == 1
    assert near.get("/rig/stop.js", Host=host)[0] == 403


@pytest.mark.parametrize("origin", [ELSEWHERE, "null", "http://127.0.0.1:1", None])
def test_a_page_of_another_origin_gets_no_websocket(near, origin):
    for path in ("/view", SOCKET, "/api/v1/webcam"):
        with pytest.raises(InvalidStatus) as refused:
            near.knock(path, origin=origin)
        assert refused.value.response.status_code == 403


@pytest.mark.parametrize("origin", [ELSEWHERE, "null", None])
def test_a_page_of_another_origin_cannot_ask_for_anything(near, origin):
    before = len(near.asked)
    status, _, _ = near.post(b'{"do": "stop", "why": "x"}', Origin=origin)
    assert status == 403 and len(near.asked) == before and near.stops == []


def test_what_is_asked_goes_to_the_rig_with_the_name_of_who_asks(near):
    named = []
    for who in ("ana", "bob", "ana"):
        body = b'{"do": "resume", "confirmed": true}'
        assert near.post(body, Cookie=near.named(who))[0] == 200
        named.append(near.asked[-1]["who"])
    assert named[0] == named[2] != named[1] and named[0].startswith("browser ")
    for chosen in ("me", named[0]):  # nobody can pose as a browser
        body = json.dumps({"do": "resume", "confirmed": True, "who": chosen}).encode()
        assert near.post(body, Cookie=near.named("bob"))[0] == 200
        assert near.asked[-1]["who"] == f"{chosen} at 127.0.0.1"
    with near.knock(SOCKET, Cookie=near.named("bob")) as end:
        assert json.loads(end.recv(timeout=PATIENCE_S))["ok"]["you"] == named[1]


def test_control_is_renewed_while_the_browser_in_control_is_there(near):
    near.answer = lambda asked: {"ok": {"reply": {"control_number": 1}}}

    def renewed() -> int:
        return [asked["do"] for asked in near.asked].count("renew")

    try:
        with near.knock(SOCKET, Cookie=near.named("ana")) as end:
            assert "ok" in answer_to(end, do="look_at", p_world_m=[1, 0, 0])
            near.asked.clear()
            while renewed() < 3:
                time.sleep(0.05)
            # A pointer is in control only while it moves.
            assert "ok" in answer_to(end, do="look_at", p_world_m=[1, 0, 0], pointer=True)
            time.sleep(0.3)
            before = renewed()
            time.sleep(0.6)  # more than two heartbeats
            assert renewed() == before
    finally:
        near.answer = lambda asked: DONE


def test_the_address_that_a_program_is_handed_opens_the_page_once(near):
    near.door.admission.one_time_token = "once-and-no-more"
    assert fetch(f"{near.url}/?token=wrong")[0] == 403
    status, headers, _ = fetch(f"{near.url}/?token=once-and-no-more")
    assert status == 302 and TOKEN in headers["Set-Cookie"] + str(headers)
    assert fetch(f"{near.url}/?token=once-and-no-more")[0] == 403
    assert (
        fetch(f"{near.url}/?token={TOKEN}")[0] == 302 and near.door.admission.one_time_token == ""
    )


def test_a_resume_of_a_browser_needs_a_person_who_confirms(near):
    near.asked.clear()
    with near.knock(SOCKET, Cookie=near.named("ana")) as end:
        for words in ({}, {"confirmed": 1}):
            status, _, text = near.post(json.dumps({"do": "resume", **words}).encode())
            assert status == 409 and 'resume needs \\"confirmed\\": true' in text
            refused = answer_to(end, do="resume", **words)["refused"]
            assert refused.startswith('resume needs "confirmed": true')
        assert near.asked == []
        assert "ok" in answer_to(end, do="resume", confirmed=True)
    assert near.post(b'{"do": "resume", "confirmed": true}')[0] == 200


@pytest.mark.parametrize(
    "body", [b"", b"nonsense", b"[1, 2]", b'"stop"', b"\xff", b"[" * 2000, b'{"a": NaN}']
)
def test_rubbish_is_not_handed_on(near, body):
    before = len(near.asked)
    assert near.post(body)[0] == 400
    assert len(near.asked) == before


def test_too_much_is_not_even_read(near):
    before = len(near.asked)
    with pytest.raises((urllib.error.URLError, ConnectionError)) as refused:
        answer = near.post(json.dumps({"do": "x" * 10_000_000}).encode())
        raise urllib.error.URLError(str(answer[0]))
    assert any(word in str(refused.value).lower() for word in ("413", "reset", "pipe"))
    assert len(near.asked) == before


# --- stop -----------------------------------------------------------------------------------


def test_a_stop_overtakes_all_that_waits_and_is_answered_by_the_rig(near):
    near.stops.clear()
    over = threading.Event()

    def answer(asked: dict[str, Any]) -> dict[str, Any]:
        if asked["do"] == "save":  # the disk is slow
            over.wait(PATIENCE_S)
        return DONE

    near.answer = answer
    try:
        with near.knock(SOCKET, Cookie=near.named("ana")) as end:
            you = json.loads(end.recv(timeout=PATIENCE_S))["ok"]["you"]
            for _ in range(10):
                end.send(json.dumps({"do": "save"}))
            end.send(json.dumps({"do": "resume", "confirmed": True, "tag": "before"}))
            end.send(json.dumps({"do": "stop", "why": "a hand", "more": ["nonsense"], "tag": 1}))
            # A resume from before the stop may not follow it.
            refusal = {"refused": "it has been stopped meanwhile", "tag": "before"}
            assert json.loads(end.recv(timeout=PATIENCE_S)) == refusal
            assert json.loads(end.recv(timeout=PATIENCE_S)) == DONE | {"tag": 1}
            assert near.stops[-1]["why"] == f"a hand ({you})"
            assert near.stops[-1]["who"].startswith(f"{you}, websocket ")
        assert near.post(b'{ "do": "stop",\n "why": "a test" }')[0] == 200
        assert near.stops[-1]["why"] == "a test"
        near.answer = lambda asked: {"refused": "it has ended"}
        status, _, text = near.post(b'{"do": "stop", "why": "late"}')
        assert status == 409 and "it has ended" in text
    finally:
        over.set()
        near.answer = lambda asked: DONE


# --- limits -----------------------------------------------------------------------------------


def test_whoever_opens_too_much_loses_his_own(near):
    """35 websockets of one visitor, 200 silent connections: another's websocket and STOP stay."""
    with near.knock(SOCKET, Cookie=near.named("ana")) as ana:
        greedy = [near.knock(SOCKET, Cookie=near.named("bob")) for _ in range(MOST_CLIENTS + 3)]
        host, port = near.address.split(":")
        silent = [socket.create_connection((host, int(port))) for _ in range(200)]
        near.stops.clear()
        assert "ok" in answer_to(ana, do="stop", why="over the websocket")
        assert near.post(b'{"do": "stop", "why": "by a request"}')[0] == 200
        assert len(near.stops) == 2
        for gone in greedy[:3]:
            with pytest.raises(ConnectionClosed):
                while True:
                    gone.recv(timeout=PATIENCE_S)
        silent[0].settimeout(PATIENCE_S)  # the idlest has gone
        with suppress(ConnectionError):
            assert silent[0].recv(1) == b""
        for _ in range(400):
            if near.door._connections.count <= MOST_CONNECTIONS + MOST_CLIENTS:
                break
            time.sleep(0.05)
        assert near.door._connections.count <= MOST_CONNECTIONS + MOST_CLIENTS
        for one in silent:
            one.close()
        for line in greedy:
            line.close()


# --- by the back ----------------------------------------------------------------------------


DRAG = msgspec.msgpack.encode(
    {
        "type": "TransformControlsUpdateMessage",
        "name": "/dragged",
        "wxyz": [1.0, 0.0, 0.0, 0.0],
        "position": [1.0, 2.0, 3.0],
    }
)


@pytest.fixture
def dragged(near: Rig) -> Iterator[viser.TransformControlsHandle]:
    handle = near.server.scene.add_transform_controls("/dragged")
    yield handle
    handle.remove()


def test_the_server_behind_the_door_is_reached_by_the_door_alone(near, dragged):
    inside = near.door._inside
    assert stat.S_ISSOCK(inside.stat().st_mode)
    assert inside.parent.stat().st_mode & 0o077 == 0  # other users cannot even go there
    ports = {line.split()[1].rpartition(":")[2] for line in listening(os.getpid())}
    assert ports <= {f"{int(rig.rpartition(':')[2]):04X}" for rig in OPENED}
    with near.knock() as socket_:  # by the door a message does something
        socket_.send(DRAG)
        for _ in range(200):
            if tuple(dragged.position) == (1.0, 2.0, 3.0):
                break
            time.sleep(0.05)
        assert tuple(dragged.position) == (1.0, 2.0, 3.0)


def listening(process: int) -> list[str]:
    """The lines of /proc/net/tcp of the ports that a process listens at."""
    held = set()
    for fd in Path(f"/proc/{process}/fd").iterdir():
        try:
            held.add(os.readlink(fd))
        except OSError:
            continue
    lines = Path("/proc/net/tcp").read_text().splitlines()[1:]
    return [x for x in lines if x.split()[3] == "0A" and f"socket:[{x.split()[9]}]" in held]


def test_a_message_that_is_too_long_ends_its_connection_alone(near):
    with near.knock() as long, near.knock() as other:
        with pytest.raises(ConnectionClosed):
            long.send(bytes(FROM_BROWSER_BYTES + 1))
            while True:
                long.recv(timeout=PATIENCE_S)
        assert other.recv(timeout=PATIENCE_S)
    with near.knock(SOCKET) as end, pytest.raises(ConnectionClosed):
        end.send("x" * 300_000)
        while True:
            end.recv(timeout=PATIENCE_S)


def test_a_browser_cannot_publish_the_page(near):
    handlers = near.server._websock_server._incoming_handlers
    assert not [kind.__name__ for kind in handlers if "ShareUrl" in kind.__name__]


# --- The token of the page: without it nothing is seen and nothing moves


@pytest.fixture(scope="module")
def far() -> Iterator[Rig]:
    """A page as other machines see it: at an address that has no name of the loopback."""
    with opened("127.0.0.2") as rig:
        yield rig


# --- the token ------------------------------------------------------------------------------


@pytest.fixture(params=["127.0.0.1", "127.0.0.2"])
def either(request: pytest.FixtureRequest, near: Rig, far: Rig) -> Rig:
    """The page for this machine, which has other users, and the one for others."""
    return near if request.param == "127.0.0.1" else far


@pytest.mark.parametrize(
    "path", ["/", "/view/", "/rig/stop.js", "/?token=wrong", "/?token=", "/?token=%ff"]
)
def test_without_the_token_nothing_is_seen(either, path):
    status, headers, text = fetch(either.url + path)
    assert status == 403 and text.startswith("refused") and len(text.splitlines()) == 1
    assert "Set-Cookie" not in headers


@pytest.mark.parametrize("cookie", [None, "wrong", "", "\xff"])
def test_without_the_token_nothing_moves(either, cookie):
    either.asked.clear()
    either.stops.clear()
    given = None if cookie is None else f"{either.door._cookie}={cookie}"
    for body in (b'{"do":"resume"}', b'{"do":"stop","why":"x"}'):
        assert either.post(body, Cookie=given)[0] == 403
    for path in ("/view", SOCKET, "/api/v1/webcam"):
        with pytest.raises(InvalidStatus) as refused:
            either.knock(path, Cookie=given)
        assert refused.value.response.status_code == 403
    assert either.asked == either.stops == []


def test_the_token_becomes_a_cookie_and_leaves_the_address(either):
    status, headers, text = fetch(f"{either.url}/?look=here&token={TOKEN}")
    assert (status, headers["Location"], text) == (302, "/?look=here", "")
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert either.get()[0] == 200
    with either.knock() as socket_:
        assert isinstance(socket_.recv(timeout=PATIENCE_S), bytes)
        assert socket_.subprotocol == VISER


def raw_answer(rig: Rig, path: str, headers: str = "") -> bytes:
    """Return the whole answer to a request whose path no client has tidied."""
    host, port = rig.address.split(":")
    with socket.create_connection((host, int(port)), PATIENCE_S) as there:
        head = f"GET {path} HTTP/1.1\r\nHost: {rig.address}\r\n{headers}Connection: close"
        there.sendall(f"{head}\r\n\r\n".encode())
        return b"".join(iter(lambda: there.recv(1 << 16), b""))


@pytest.mark.parametrize(
    "path", ["//evil/", "/%5Cevil/", "/\\evil/", "///evil", "//evil/%2e%2e//x"]
)
def test_the_token_leads_to_this_page_and_nowhere_else(near, path):
    answer = raw_answer(near, f"{path}?token={TOKEN}").decode()
    place = next(line for line in answer.splitlines() if line.startswith("Location: "))
    assert place.startswith("Location: /") and place[11:12] not in ("/", "\\")


@pytest.mark.parametrize(
    "path",
    ["/../../../../etc/passwd", "/%2e%2e/%2e%2e/%2e%2e/etc/passwd", "/..%2f..%2f..%2fetc%2fpasswd",
     "//etc/passwd", "/assets/../../../../../../etc/passwd", "/\\..\\etc\\passwd"],
)  # fmt: skip
def test_no_path_leads_out_of_the_pages_own_files(near, path):
    answer = raw_answer(near, path, f"Cookie: {near.cookie}\r\n")
    assert b"root:" not in answer and b" 500 " not in answer.splitlines()[0]


# --- Limits of a browser of the page, and a stop without an answer


def test_a_stop_that_the_rig_does_not_answer_is_said_and_the_next_one_is_sent():
    with opened("127.0.0.1") as rig:
        over = threading.Event()

        def stalls(asked: dict[str, Any]) -> dict[str, Any]:
            over.wait(PATIENCE_S)
            return DONE

        rig.answer = stalls
        status, _, text = rig.post(b'{"do": "stop", "why": "x"}')
        assert status == 503 and "does not answer" in text
        over.set()
        assert rig.post(b'{"do": "stop", "why": "x"}')[0] == 200
        assert len(rig.stops) == 2


def test_neither_websockets_nor_slow_requests_shut_out_a_stop(near):
    """Websockets have limits of their own, and a request that has just begun is not closed."""
    head = f"POST /api/v1/do HTTP/1.1\r\nHost: {near.address}\r\nOrigin: {near.url}\r\n"
    head += f"Cookie: {near.cookie}\r\nContent-Length: 14\r\n\r\n"

    def begin() -> socket.socket:
        host, port = near.address.split(":")
        return socket.create_connection((host, int(port)), PATIENCE_S)

    def stop() -> bytes:
        with begin() as one:
            time.sleep(0.1)  # what is too much is closed meanwhile
            one.sendall(head.encode() + b'{"do": "stop"}')
            return one.recv(12)

    with ExitStack() as stack:
        websockets = [stack.enter_context(near.knock(SOCKET)) for _ in range(32)]
        websockets += [stack.enter_context(near.knock("/api/v1/webcam")) for _ in range(2)]
        near.stops.clear()
        assert stop() == b"HTTP/1.1 200"
        for _ in range(150):
            stack.enter_context(begin()).sendall(head.encode())
        assert stop() == b"HTTP/1.1 200"
        for one in websockets:
            one.ping()
        assert len(near.stops) == 2


def test_a_flood_of_one_browser_does_not_hold_up_a_stop(near):

    def answer_slowly(asked: object) -> Any:
        time.sleep(0.05)  # as a rig that is busy
        return DONE

    near.answer = answer_slowly
    before = len(near.stops)
    try:
        with near.knock(SOCKET) as end:
            for k in range(600):
                end.send(json.dumps({"do": "set", "changes": {"a": k}}))
            start_s = time.monotonic()
            assert near.post(b'{"do": "stop", "why": "a test"}')[0] == 200
            assert len(near.stops) == before + 1
            assert time.monotonic() - start_s < 0.5 * PATIENCE_S
    finally:
        near.answer = lambda asked: DONE
