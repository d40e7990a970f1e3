"""Programs of the network command a running head: real bytes through HTTP and a websocket."""

import contextlib
import json
import os
import shutil
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import pytest
from branch import Branch, gazerig
from browser import browsing
from page_visitor import fetch
from shown_page import free_port, wait_for
from slow_rigs import at_rate
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from gazerig.drivers.errors import DriverError
from gazerig.robot.loop import body
from gazerig.robot.model.commands import Jog, LookAt, Resume
from gazerig.robot.net.client import RobotClient

ROOT = Path(__file__).parents[2]

PATIENCE_S = 60.0
HELD_S = 0.2
"""A stop holds so long, and there are so many between two resumes, that the tests wait less."""


class Rig(NamedTuple):
    """A head in another process, with a page."""

    url: str
    token: str
    client: RobotClient

    @property
    def base(self) -> str:
        return f"{self.url}/api/v1"

    def get(self, path: str, **headers: str) -> tuple[int, Any]:
        status, _, text = fetch(f"{self.base}{path}", {**self.shown, **headers})
        return status, json.loads(text)

    def post(self, body: object, query: str = "", **headers: str) -> tuple[int, Any]:
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        status, _, text = fetch(f"{self.base}/do{query}", {**self.shown, **headers}, data)
        return status, json.loads(text)

    @property
    def shown(self) -> dict[str, str]:
        return {"Authorization": f"Bearer {self.token}"}

    def dial(self, query: str = "", origin: str | None = None, token: str = "") -> ClientConnection:
        address = self.base.replace("http", "ws", 1)
        return connect(
            f"{address}/socket?token={token or self.token}{query}",
            origin=Origin(origin) if origin is not None else None,
            compression=None,
            max_size=None,
            open_timeout=PATIENCE_S,
            close_timeout=0.1,  # who floods does not read the answer to its farewell
        )

    def ticks(self) -> int:
        return int(self.client.status()["ticks"])

    def until(self, right: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Wait until the status is as it should be."""
        end_s = time.monotonic() + PATIENCE_S
        while not right(now := self.client.status()):
            assert time.monotonic() < end_s, now
            time.sleep(0.02)
        return now

    def resume(self) -> None:
        """Resume after a stop, as soon as it has held."""
        time.sleep(HELD_S + 0.1)
        self.client.send(Resume(confirmed=True))


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    folder = Path(tempfile.mkdtemp(prefix="gz-", dir="/tmp"))
    file = at_rate(folder, "desk", 20.0)
    address = f"127.0.0.1:{free_port()}"
    with pytest.MonkeyPatch.context() as patch, (folder / "log").open("w") as log:
        patch.setenv("XDG_RUNTIME_DIR", str(folder))
        patch.setattr(body, "MIN_HOLD_S", HELD_S)
        patch.setattr(body, "MIN_RESUME_GAP_S", HELD_S)
        words = ("run", file, "--mock", "--bus", "ideal", "--name", "eva", "--no-browser",
                 "--page", address)  # fmt: skip
        process = Branch(gazerig(*words), stdout=log, stderr=log, env=dict(os.environ), cwd=folder)
        try:
            client = reached(process)
            end_s = time.monotonic() + PATIENCE_S
            while not (page := client.status()["page"]) or not client.status()["ticks"]:
                assert time.monotonic() < end_s, (folder / "log").read_text()
                time.sleep(0.1)
            parts = urlsplit(page)
            url = f"{parts.scheme}://{parts.netloc}"
            yield Rig(url, parts.query.removeprefix("token="), client)
            client.close()
        finally:
            process.terminate()
            process.wait(PATIENCE_S)
            shutil.rmtree(folder)


def reached(process: subprocess.Popen[Any]) -> RobotClient:
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return RobotClient.connect("eva", "the test")
        except DriverError:
            assert time.monotonic() < end_s and process.poll() is None
            time.sleep(0.1)


@pytest.fixture(autouse=True)
def free(rig: Rig) -> Iterator[None]:
    """Leave each test with a head that moves and chooses its targets."""
    yield
    time.sleep(0.1)  # the limits of rates fill again, by ten messages
    if rig.client.status()["stopped"]:
        rig.resume()
    rig.client.send(LookAt(None))
    rig.client.send(Jog(()))


def heard(end: Connection, key: str, value: object = None) -> dict[str, Any]:
    """Return the next message with a key, and a value if one is given."""
    stop_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < stop_s:
        message: dict[str, Any] = json.loads(end.recv(timeout=PATIENCE_S))
        if key in message and value in (None, message[key]):
            return message
    raise TimeoutError(key)


def ask(end: Connection, **message: object) -> None:
    end.send(json.dumps(message))


def client_frame(text: str) -> bytes:
    """Return a text message of a client, whose mask changes nothing."""
    return bytes((0x81, 0x80 | len(text))) + bytes(4) + text.encode()


LEFT, RIGHT = [1.0, 0.3, 0.3], [1.0, -0.3, 0.3]


# Purpose


def test_orders_have_outcomes(rig):
    status, answer = rig.post({"do": "look_at", "p_world_m": LEFT, "tag": "a"}, "?wait_s=15")
    assert status == 200 and answer["tag"] == "a" and answer["outcome"] == "arrived"
    behind = rig.post({"do": "look_at", "p_world_m": [-1, 0.1, 0.3]}, "?wait_s=15")[1]
    assert behind["outcome"] == "out of reach"
    assert rig.post({"do": "play", "track": "nod"}, "?wait_s=15")[1]["outcome"] == "arrived"
    status, answer = rig.post({"do": "look_at_person", "id": 99})
    assert status == 409 and "99" in answer["refused"] and answer["reply"]["refused"]
    assert "outcome" not in rig.post({"do": "play", "track": "nod"}, "?wait_s=0")[1]
    assert "neck_yaw" in rig.post({"do": "status"})[1]["ok"]["joints"]


def test_a_websocket_has_outcomes_states_and_events_and_keeps_control_while_it_is_open(rig):
    with rig.dial() as end:
        assert heard(end, "tag", "hello")["ok"] == {
            "version": 1, "rig": rig.client.status()["rig"], "name": "eva", "pid": rig.client.pid,
            "you": "a program at 127.0.0.1",
        }  # fmt: skip
        ask(end, do="look_at", p_world_m=LEFT, who="a show", tag=1)
        assert heard(end, "tag", 1)["ok"]["reply"]["control_number"] > 0
        assert heard(end, "outcome") == {"outcome": "arrived", "why": "", "tag": 1}
        led = rig.client.status()["controlled_by"]
        assert led.startswith("a show at 127.0.0.1: look at")
        with rig.dial("&rate_hz=5") as slow:
            heard(slow, "state")
            began_s, count = time.monotonic(), 8
            receive_states(slow, count)
            assert time.monotonic() - began_s > 0.7 * count / 5.0
        assert rig.client.status()["controlled_by"] == led  # renewed meanwhile
        ask(end, do="look_at", p_world_m=RIGHT, tag=2)
        ask(end, do="look_at", p_world_m=LEFT, tag=3)
        outcomes = [heard(end, "outcome") for _ in range(2)]
        assert {one["tag"]: one["outcome"] for one in outcomes} in (
            {2: "taken over", 3: "arrived"},
            {2: "arrived", 3: "arrived"},
        )
    with rig.dial("&rate_hz=25&events=true") as quick:
        receive_states(quick, 8)
        kinds: set[str] = set()
        while not {"saccade_start", "saccade_landing", "target"} <= kinds:
            event = heard(quick, "event")["event"]
            assert set(event) == {"number", "t_s", "text", "kind", "subject"}
            kinds.add(event["kind"])
    rig.until(lambda now: not now["controlled_by"])


def receive_states(end: Connection, count: int) -> None:
    """Receive states, the newest last, of more than one moment."""
    times = [heard(end, "state")["state"]["t_s"] for _ in range(count)]
    assert times == sorted(times) and len(set(times)) > 1


# Leaving


def test_who_is_killed_or_hangs_while_leading_gives_control_back(rig):
    end = rig.dial()
    ask(end, do="jog", angles_rad=[["neck_yaw", 0.1]], tag=1)
    heard(end, "tag", 1)
    rig.until(lambda now: now["controlled_by"])
    # Its computer is gone: no more packets, no farewell.
    end.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
    end.socket.close()
    rig.until(lambda now: not now["controlled_by"])
    # A suspended program answers no ping, though its connection stays open.
    parts = urlsplit(rig.url)
    with socket.create_connection((parts.hostname or "", parts.port or 0)) as hung:
        hung.sendall(
            f"GET /api/v1/socket?token={rig.token} HTTP/1.1\r\nHost: {parts.netloc}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        hung.sendall(client_frame(json.dumps({"do": "look_at", "p_world_m": LEFT})))
        rig.until(lambda now: now["controlled_by"])
        rig.until(lambda now: not now["controlled_by"])


def test_stop_goes_through_and_who_stopped_may_resume(rig):
    with rig.dial() as end:
        ask(end, do="stop", why="a hand", who="a show", tag="s")
        assert "ok" in heard(end, "tag", "s")
        assert rig.client.status()["stopped"] == "a hand"
        time.sleep(HELD_S + 0.1)
        with rig.dial() as other:  # of the same host, and a name can be chosen
            for number, who in enumerate(("a show", "a show at 127.0.0.1, websocket 1")):
                ask(other, do="resume", who=who, tag=number)
                assert "no hand" in heard(other, "tag", number)["refused"]
        for query in ("", "?wait_s=0"):
            status, answer = rig.post({"do": "resume", "who": "a show"}, query)
            assert status == 409 and 'needs "confirmed": true' in answer["refused"]
        assert rig.client.status()["stopped"]
        ask(end, do="resume", who="a show", tag="q")
        assert "ok" in heard(end, "tag", "q")
    assert not rig.client.status()["stopped"]
    assert rig.post({"do": "stop"})[0] == 200
    assert rig.get("/state")[1]["ok"]["state"]["stopped"]  # not older than the answer
    assert rig.client.status()["stopped"]
    time.sleep(HELD_S + 0.1)
    assert rig.post({"do": "resume", "confirmed": False})[0] == 409
    assert rig.post({"do": "resume", "confirmed": True})[0] == 200
    assert not rig.client.status()["stopped"]


# Bad input


DEEP = b'{"do":' + b"[" * 20000 + b"]" * 20000 + b"}"
BAD = (
    (b"{", 400, "not JSON"),
    (DEEP, 400, "nested too deep"),
    (b'{"do": "status", "tag": [1]}', 400, "tag: a whole number or text"),
    (b'{"do": "look_at", "p_world_m": [NaN, 0, 0]}', 400, "not JSON"),
    (b'{"do": "look_at", "p_world_m": [1, 0, 0], "x": 1}', 409, "look_at has p_world_m, pointer"),
    (b'{"do": "dance"}', 409, "available: hello"),
    (b'{"do": "save", "path": "/etc/passwd.yaml"}', 409, "only files in"),
    (b'{"do": "ask", "menu": "character", "choice": "/etc/passwd"}', 409, "and below can be named"),
    (b'{"do": "set", "changes": {"doors": ["wyoming"]}}', 409, "cannot be set over the network"),
    (b" " * 70_000, 413, "longer than 65536 bytes"),
)
BAD_QUERIES = (
    ("/socket?rate_hz=0", "1.0 - at `$.rate_hz`"),
    ("/socket?rate_hz=nan", "$.rate_hz"),
    ("/state?after=-1", "$.after"),
)


def test_a_bad_message_gets_one_clear_error(rig):
    for message, wanted, text in BAD:
        status, answer = rig.post(message)
        assert status == wanted and list(answer) in (["refused"], ["refused", "tag"]), answer
        assert text in answer["refused"] and "\n" not in answer["refused"]
        with rig.dial() as end:
            heard(end, "tag", "hello")
            end.send(message.decode())
            assert json.loads(end.recv(timeout=PATIENCE_S)) == answer
            ask(end, do="menus", tag=1)  # the connection goes on
            assert "shy" in heard(end, "tag", 1)["ok"]["character"]
    for path, text in BAD_QUERIES:
        status, answer = rig.get(path, Upgrade="websocket", Connection="Upgrade")
        assert status == 400 and text in answer["refused"], path


# Allowed visitors


def test_without_the_token_or_from_another_site_nothing_is_answered(rig):
    for headers in ({"Authorization": "Bearer wrong"}, {"Authorization": "nonsense"}):
        status, answer = rig.get("/state", **headers)
        assert status == 403 and "show the token" in answer["refused"]
        status, answer = rig.post({"do": "status"}, **headers)
        assert status == 403 and "gazerig ctl rigs" in answer["refused"]
    with pytest.raises(InvalidStatus) as refused:
        rig.dial(token="wrong")
    assert refused.value.response.status_code == 403
    status, answer = rig.post({"do": "status"}, Origin="http://elsewhere.example")
    assert status == 403 and "another origin" in answer["refused"]
    for origin in ("http://elsewhere.example", "http://localhost:1"):
        with pytest.raises(InvalidStatus):
            rig.dial(origin=origin)
    with rig.dial(origin="null") as own:  # a file that its user has opened and given the token
        heard(own, "tag", "hello")
    with pytest.raises(InvalidStatus):
        rig.dial(origin="null", token="wrong")
    status, _, _ = fetch(f"{rig.base}/state", {**rig.shown, "Host": "elsewhere.example"})
    assert status == 403


# Floods and slow readers


LEVEL = '{"do": "set_level", "level": "jaw", "value": 1}'


def test_a_flood_is_refused_and_a_stop_of_anybody_goes_through(rig):
    """So many at once that most are too many, and so few that the connection stays."""
    with rig.dial() as flood:
        heard(flood, "tag", "hello")
        flood.socket.sendall(280 * client_frame('{"do": "look_at", "p_world_m": [1, 0, 0]}'))
        ask(flood, do="stop", why="in the flood", tag="s")
        with rig.dial() as other:
            ask(other, do="stop", why="another", tag=1)
            assert "ok" in heard(other, "tag", 1)
        answers = [json.loads(flood.recv(timeout=PATIENCE_S))]
        while not ("ok" in answers[-1] and answers[-1].get("tag") == "s"):
            answers.append(json.loads(flood.recv(timeout=PATIENCE_S)))
        assert any("too many requests" in one.get("refused", "") for one in answers)
    ticks = rig.ticks()
    assert rig.until(lambda now: now["ticks"] > ticks)["stopped"]


def test_a_stop_does_not_wait_for_what_its_program_has_sent_before(rig):
    for message in (LEVEL, "rubbish"):
        with rig.dial() as flood:
            heard(flood, "tag", "hello")
            for _ in range(3000):
                flood.send(message)
            sent_s = time.monotonic()
            ask(flood, do="stop", why=message, tag="s")
            assert rig.until(lambda now: now["stopped"])["stopped"] == message
            assert time.monotonic() - sent_s < 20.0  # at most .3 on a quiet machine
        rig.resume()
    # Also as the last message before the end of its connection, however it is written.
    for stop in ("stop", "st\\u006fp"):
        with rig.dial() as end:
            heard(end, "tag", "hello")
            last = client_frame(f'{{"do": "{stop}", "why": "{stop}"}}')
            end.socket.sendall(3000 * client_frame(LEVEL) + last)
            end.socket.close()
            assert rig.until(lambda now: now["stopped"])["stopped"] == "stop"
        rig.resume()


def test_who_sends_far_too_much_is_disconnected_after_its_stop(rig):
    with rig.dial() as flood:

        def read() -> None:
            with contextlib.suppress(ConnectionClosed):
                for _ in flood:
                    pass

        reader = threading.Thread(target=read)
        reader.start()
        began_s, stops = time.monotonic(), False
        with pytest.raises(ConnectionClosed) as closed:
            while time.monotonic() < began_s + PATIENCE_S:
                flood.send("rubbish")
                if not stops and time.monotonic() > began_s + 1.0:
                    stops = True
                    ask(flood, do="stop", why="before the end")
                time.sleep(0.0005)
        reader.join()
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
    assert closed.value.rcvd.reason.startswith("too many requests: more than 200 refused in 1 s")
    assert rig.until(lambda now: now["stopped"])["stopped"] == "before the end"


# Examples


def test_the_browser_example_shows_the_head_and_commands_it(rig):
    file = ROOT / "examples" / "browser.html"
    assert len(file.read_text(encoding="utf-8").splitlines()) <= 100
    with browsing((390, 800)) as browser:
        browser.go(f"{file.as_uri()}#{rig.url}/?token={rig.token}")
        wait_for(lambda: "look" in browser.words().splitlines()[0], "the headline")
        click = "new MouseEvent('click', {clientX: 200, clientY: 150})"
        browser.run(f"document.querySelector('canvas').dispatchEvent({click})")
        led = rig.until(lambda now: now["controlled_by"])["controlled_by"]
        assert led.startswith("browser.html at 127.0.0.1")
        wait_for(lambda: "look_at 1: " in browser.words(), "the outcome")
        browser.run("document.querySelector('#stop').click()")
        rig.until(lambda now: now["stopped"])
        wait_for(lambda: "stopped: browser.html" in browser.words(), "the stop")
    rig.until(lambda now: not now["controlled_by"])
