"""Only those come in who may: no other origin, nobody without the token, nobody by the back."""

import json
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from robot.page.door import Door, compact, needs_token
from robot.page.server import open_server

PATIENCE_S = 20.0
VISER = [f"viser-v{viser.__version__}"]
SECRET = "what only the door knows"
ELSEWHERE = "http://elsewhere.example"


class Opener(urllib.request.HTTPRedirectHandler):
    """Follows no redirect, so that it can be looked at."""

    def redirect_request(self, *_: object) -> None:
        return None


def fetch(
    url: str, headers: dict[str, str] | None = None, body: bytes | None = None
) -> tuple[int, dict[str, str], str]:
    """Status, headers and text of an answer, whatever the status is."""
    request = urllib.request.Request(url, data=body, headers=headers or {})
    try:
        answer = urllib.request.build_opener(Opener).open(request, timeout=PATIENCE_S)
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.status, dict(answer.headers), answer.read().decode()


class Rig:
    """A door with a server behind it, and what was asked through it."""

    def __init__(self, host: str) -> None:
        self.asked: list[bytes] = []
        self.takes = True
        with socket.socket() as trial:
            trial.bind((host, 0))
            port = trial.getsockname()[1]
        self.server = open_server(SECRET)
        self.door = Door(host, port, self.server.get_port(), SECRET, self.take)
        self.door.open()
        self.address = f"{host}:{port}"
        self.url = f"http://{self.address}"

    def take(self, data: bytes) -> bool:
        self.asked.append(data)
        return self.takes

    def knock(self, **headers: str | None) -> ClientConnection:
        """Open the page's websocket as a browser does, with other headers as given."""
        origin = headers.pop("origin", self.url)
        return connect(
            f"ws://{self.address}/",
            origin=origin,
            subprotocols=VISER,
            max_size=None,
            compression=None,
            open_timeout=PATIENCE_S,
            additional_headers={k: v for k, v in headers.items() if v is not None},
        )


@contextmanager
def opened(host: str) -> Iterator[Rig]:
    rig = Rig(host)
    try:
        yield rig
    finally:
        rig.door.close()
        rig.server.stop()


@pytest.fixture(scope="module")
def near() -> Iterator[Rig]:
    """A page for this machine alone."""
    with opened("127.0.0.1") as rig:
        yield rig


@pytest.fixture(scope="module")
def far() -> Iterator[Rig]:
    """A page for other machines: every address but the three names of the loopback."""
    with opened("127.0.0.2") as rig:
        yield rig


def test_who_needs_a_token() -> None:
    assert not any(map(needs_token, ("127.0.0.1", "localhost", "::1")))
    assert all(map(needs_token, ("0.0.0.0", "::", "192.168.1.5", "127.0.0.2", "rig.local")))


# --- on this machine ----------------------------------------------------------------------


def test_the_page_comes_with_its_stop_button(near: Rig) -> None:
    status, headers, text = fetch(near.url)
    assert status == 200 and '<script src="/rig/stop.js"></script>' in text
    assert headers["X-Frame-Options"] == "DENY"
    status, headers, text = fetch(f"{near.url}/rig/stop.js")
    assert status == 200 and "text/javascript" in headers["Content-Type"] and "STOP" in text


def test_a_browser_gets_what_the_server_sends(near: Rig) -> None:
    near.server.gui.add_html("words for the test")
    with near.knock() as socket_:
        assert isinstance(socket_.recv(timeout=PATIENCE_S), bytes)
        assert socket_.subprotocol == VISER[0]


def test_localhost_by_name_may_come_in(near: Rig) -> None:
    port = near.address.rpartition(":")[2]
    name = f"localhost:{port}"
    assert fetch(near.url, {"Host": name})[0] == 200
    # The tunnel of another machine has a port of its own.
    assert fetch(near.url, {"Host": "localhost:9999"})[0] == 200


@pytest.mark.parametrize("host", ["elsewhere.example", "127.0.0.1.elsewhere.example", "10.0.0.1"])
def test_a_foreign_name_for_this_machine_is_refused(near: Rig, host: str) -> None:
    status, _, text = fetch(near.url, {"Host": host})
    assert status == 403 and text.startswith("refused") and len(text.splitlines()) == 1
    assert fetch(f"{near.url}/rig/state", {"Host": host})[0] == 403


@pytest.mark.parametrize("origin", [ELSEWHERE, "null", "http://127.0.0.1:1", None])
def test_a_page_of_another_origin_gets_no_websocket(near: Rig, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as refused:
        near.knock(origin=origin)
    assert refused.value.response.status_code == 403


def test_rebinding_a_name_to_this_machine_gets_no_websocket(near: Rig) -> None:
    # The browser then sends the foreign name as Host and as Origin.
    port = near.address.rpartition(":")[2]
    with socket.create_connection(("127.0.0.1", int(port))) as there:
        there.sendall(
            f"GET / HTTP/1.1\r\nHost: elsewhere.example:{port}\r\nUpgrade: websocket\r\n"
            f"Origin: http://elsewhere.example:{port}\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        assert b" 403 " in there.recv(4096).splitlines()[0]


@pytest.mark.parametrize("origin", [ELSEWHERE, "null", None])
def test_a_page_of_another_origin_cannot_ask_for_anything(near: Rig, origin: str | None) -> None:
    before = len(near.asked)
    headers = {"Origin": origin} if origin is not None else {}
    status, _, _ = fetch(f"{near.url}/rig/ask", headers, b'{"order": "stop", "why": "x"}')
    assert status == 403 and len(near.asked) == before


def test_what_is_asked_goes_to_the_rig_compact(near: Rig) -> None:
    body = b'{ "order": "stop",\n "why": "a test" }'
    status, _, _ = fetch(f"{near.url}/rig/ask", {"Origin": near.url}, body)
    assert (status, near.asked[-1]) == (204, b'{"order":"stop","why":"a test"}')


def test_what_the_rig_does_not_take_is_told(near: Rig) -> None:
    near.takes = False
    try:
        status, _, text = fetch(f"{near.url}/rig/ask", {"Origin": near.url}, b"{}")
        assert status == 503 and "does not take" in text
    finally:
        near.takes = True


@pytest.mark.parametrize("body", [b"", b"nonsense", b"[1, 2]", b'"stop"', b"\xff"])
def test_rubbish_is_not_handed_on(near: Rig, body: bytes) -> None:
    before = len(near.asked)
    assert fetch(f"{near.url}/rig/ask", {"Origin": near.url}, body)[0] == 400
    assert len(near.asked) == before


def test_too_much_is_not_even_read(near: Rig) -> None:
    before = len(near.asked)
    body = json.dumps({"pick": "x" * 100_000}).encode()
    assert fetch(f"{near.url}/rig/ask", {"Origin": near.url}, body)[0] == 413
    assert len(near.asked) == before


def test_the_stop_button_is_told_of_every_change(near: Rig) -> None:
    near.door.tell({"stopped": ""})
    with urllib.request.urlopen(f"{near.url}/rig/state", timeout=PATIENCE_S) as stream:
        assert json.loads(stream.readline().removeprefix(b"data: ")) == {"stopped": ""}
        near.door.tell({"stopped": "a test"})
        lines = (stream.readline() for _ in range(20))
        assert any(b"a test" in line for line in lines)


# --- from other machines ------------------------------------------------------------------


@pytest.mark.parametrize("path", ["/", "/rig/state", "/rig/stop.js", "/?token=wrong", "/?token="])
def test_without_the_token_nothing_is_seen(far: Rig, path: str) -> None:
    status, headers, text = fetch(far.url + path)
    assert status == 403 and text.startswith("refused") and len(text.splitlines()) == 1
    assert "Set-Cookie" not in headers


def test_without_the_token_nothing_moves(far: Rig) -> None:
    headers = {"Origin": far.url}
    assert fetch(f"{far.url}/rig/ask", headers, b'{"order":"resume"}')[0] == 403
    wrong = {**headers, "Cookie": f"{far.door._cookie}=wrong"}
    assert fetch(f"{far.url}/rig/ask", wrong, b'{"order":"resume"}')[0] == 403
    assert far.asked == []


@pytest.mark.parametrize("cookie", [None, "wrong"])
def test_without_the_token_there_is_no_websocket(far: Rig, cookie: str | None) -> None:
    given = None if cookie is None else f"{far.door._cookie}={cookie}"
    with pytest.raises(InvalidStatus) as refused:
        far.knock(Cookie=given)
    assert refused.value.response.status_code == 403


def test_the_token_becomes_a_cookie_and_leaves_the_address(far: Rig) -> None:
    status, headers, text = fetch(f"{far.url}/?look=here&token={far.door.token}")
    assert (status, headers["Location"], text) == (302, "/?look=here", "")
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    pair = cookie.partition(";")[0]
    assert fetch(far.url, {"Cookie": pair})[0] == 200
    with far.knock(Cookie=pair) as socket_:
        assert socket_.recv(timeout=PATIENCE_S)


def test_the_token_does_not_help_another_origin(far: Rig) -> None:
    pair = f"{far.door._cookie}={far.door.token}"
    with pytest.raises(InvalidStatus):
        far.knock(Cookie=pair, origin=ELSEWHERE)
    headers = {"Cookie": pair, "Origin": ELSEWHERE}
    assert fetch(f"{far.url}/rig/ask", headers, b'{"order":"resume"}')[0] == 403
    assert far.asked == []


def test_two_doors_have_two_tokens(far: Rig) -> None:
    with opened("127.0.0.2") as other:
        assert other.door.token != far.door.token
        assert fetch(f"{other.url}/?token={far.door.token}")[0] == 403
    assert far.door.token is not None and len(far.door.token) >= 32


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


@pytest.mark.parametrize("origin", [None, "http://127.0.0.1", ELSEWHERE])
def test_the_server_behind_the_door_takes_nobody_else(
    near: Rig, dragged: viser.TransformControlsHandle, origin: str | None
) -> None:
    url = f"ws://127.0.0.1:{near.server.get_port()}/"
    with connect(url, origin=origin, subprotocols=VISER, max_size=None) as socket_:
        with pytest.raises(ConnectionClosed) as closed:
            socket_.send(DRAG)
            socket_.recv(timeout=PATIENCE_S)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
    assert tuple(dragged.position) == (0.0, 0.0, 0.0)
    with near.knock() as socket_:  # by the door the same message does something
        socket_.send(DRAG)
        for _ in range(200):
            if tuple(dragged.position) == (1.0, 2.0, 3.0):
                break
            time.sleep(0.05)
        assert tuple(dragged.position) == (1.0, 2.0, 3.0)


def test_a_browser_cannot_publish_the_page(near: Rig) -> None:
    handlers = near.server._websock_server._incoming_handlers
    assert not [kind.__name__ for kind in handlers if "ShareUrl" in kind.__name__]


def test_compact_takes_objects_only() -> None:
    assert compact(b'{"a": [1, 2]}') == b'{"a":[1,2]}'
    assert compact(b"[]") is None and compact(b"{") is None
