"""A server with the page's files that speaks as the rig does, and says what a test wants.

The page's scripts do not notice: the messages are made of the types of the public websocket. The
frame of the view has no head, but the camera of one.
"""

import asyncio
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

import msgspec
from aiohttp import WSMsgType, web
from desk import GAZE_JOINTS
from fakes.runs import play, simulated
from msgspec.structs import replace

from gazerig.config.parameters import parameters, values
from gazerig.config.schema import load_rig
from gazerig.robot.dashboard.door.page_door import add_headers
from gazerig.robot.dashboard.door.page_files import add_page_files
from gazerig.robot.loop.head_state import head_state
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.types import LoopFigures
from gazerig.robot.net.topics import JointInfo, Picture, RigInfo, RunState, SeenFace

YOU = "browser 1a2b"
LIMITS = JointInfo(-1.0, 1.0, 55.0, 65.0, 4.5, 8.4, 0.4)
RIG = RigInfo("desk", "/tmp/desk.yaml", False, False, "", "", dict.fromkeys(GAZE_JOINTS, LIMITS))
IN_TIME = LoopFigures(200.0, 0, 10.0, 0.0, 1.0)
RUN = RunState("wait", "none", "shy", "", "bus ok", 1, IN_TIME)
PICTURE = Picture(
    1, 0.0, 640, 400, (320.0, 200.0), (SeenFace((260.0, 120.0, 120.0, 150.0), (), 0.9),), (), (),
)  # fmt: skip
MENUS = {
    "behaviour": ["wait", "guard", "attack"], "conversation": ["none", "talk", "listen", "think"],
    "track": ["none", "nod", "wave", "shake", "surprised", "sleepy"], "lids": ["wink left", "wink right"],
    "expression": ["neutral", "happy", "sad"], "character": ["none", "bold", "shy", "boxer"],
}  # fmt: skip
VIEW = """<!doctype html><title>no head</title><body style="margin:0;height:100vh"><script>
// A camera 1 m ahead of the neck base and 0.2 m above, which looks back along the x axis.
window.__viserMutable = {camera: {
  matrixWorld: {elements: [-1,0,0,0, 0,1,0,0, 0,0,-1,0, 0,0.2,-1,1]},
  projectionMatrix: {elements: [2,0,0,0, 0,2,0,0, 0,0,-1,-1, 0,0,0,0]},
}};
</script>"""


@cache
def first_tick() -> Tick:
    """Return the tick of a rig after 1.2 s: it looks at the mouth of a person."""
    made, ticks = simulated("desk", "face-to-face", bus="ideal"), list[Tick]()
    play(made, 1.2, ticks.append)
    return ticks[-1]


class Stub:
    """The server, in a thread of its own.

    asked: messages of the browsers, oldest first
    state, rig, run: what a browser receives when it connects, and with ``show``
    usual: verb -> usual answer
    answer: returns the answer to a message, None for the usual one
    missing: files that the server does not have
    """

    def __init__(self) -> None:
        self._sockets: set[web.WebSocketResponse] = set()
        self._loop = asyncio.new_event_loop()
        self.reset()

    def reset(self) -> None:
        """Be as at first."""
        self.asked: list[dict[str, Any]] = []
        self.state, self.rig, self.run = head_state(first_tick()), RIG, RUN
        self.answer: Callable[[dict[str, Any]], dict[str, Any] | None] = lambda asked: None
        self.missing: set[str] = set()
        rig = load_rig("desk")
        live = [one for one in parameters(rig, rig) if one.live == "next tick"]
        self.usual: dict[str, object] = {
            "menus": MENUS,
            "parameters": live, "get": values(rig), "unsaved": [],
        }  # fmt: skip

    async def open(self) -> str:
        """Serve, and return the address."""
        app = web.Application(middlewares=[self._refuse_missing])
        app.on_response_prepare.append(add_headers)
        add_page_files(app.router)
        app.router.add_get("/view/", _answer_view)
        app.router.add_get("/api/v1/socket", self._serve_socket)
        app.router.add_get("/api/v1/waveform", _answer_waveform)
        app.router.add_post("/api/v1/do", self._serve_request)
        self._runner = web.AppRunner(app, shutdown_timeout=0.1)
        await self._runner.setup()
        site = web.TCPSite(self._runner, "127.0.0.1", 0)
        await site.start()
        return f"http://{self._runner.addresses[0][0]}:{self._runner.addresses[0][1]}/"

    @web.middleware
    async def _refuse_missing(self, request: web.Request, handler: Any) -> web.StreamResponse:
        if request.path.rpartition("/")[2] in self.missing:
            raise web.HTTPNotFound
        answer: web.StreamResponse = await handler(request)
        return answer

    async def _serve_socket(self, request: web.Request) -> web.StreamResponse:
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        await socket.send_str(json.dumps({"ok": {"version": 1, "you": YOU}, "tag": "hello"}))
        for kind, value in (("rig", self.rig), ("run", self.run), ("state", self.state)):
            await socket.send_str(_encode(kind, value))
        self._sockets.add(socket)
        async for message in socket:
            if message.type is WSMsgType.TEXT:
                await socket.send_str(self._handle(json.loads(message.data)))
        self._sockets.discard(socket)
        return socket

    async def _serve_request(self, request: web.Request) -> web.Response:
        return web.Response(
            text=self._handle(await request.json()), content_type="application/json"
        )

    def _handle(self, asked: dict[str, Any]) -> str:
        tag = asked.pop("tag", None)
        answer = self.answer(asked)
        self.asked.append(asked)
        if answer is None:
            answer = {"ok": self.usual.get(asked["do"], {"notes": []})}
        return msgspec.json.encode({**answer, "tag": tag}).decode()

    def show(self, **changes: Any) -> None:
        """Send the state with other values, one tick later, and the run."""
        self.state = replace(self.state, t_s=self.state.t_s + 0.04, **changes)
        self.send("state", self.state)
        self.send("run", self.run)

    def send(self, kind: str, value: object, image: bytes | None = None) -> None:
        """Send a message to all browsers, and the image that belongs to a picture."""

        async def send_all() -> None:
            for socket in tuple(self._sockets):
                with suppress(ConnectionError):
                    await socket.send_str(_encode(kind, value))
                    if image is not None:
                        await socket.send_bytes(image)

        asyncio.run_coroutine_threadsafe(send_all(), self._loop).result()

    def orders(self, verb: str) -> list[dict[str, Any]]:
        """Return the messages with a verb, oldest first."""
        return [one for one in self.asked if one["do"] == verb]


def _encode(kind: str, value: object) -> str:
    return msgspec.json.encode({kind: value}).decode()


async def _answer_view(request: web.Request) -> web.Response:
    return web.Response(text=VIEW, content_type="text/html")


async def _answer_waveform(request: web.Request) -> web.Response:
    return web.json_response({"ok": [0.5] * 160})


@contextmanager
def serving() -> Iterator[tuple[Stub, str]]:
    """Return a stub and its address."""
    stub = Stub()
    thread = threading.Thread(target=stub._loop.run_forever)
    thread.start()
    try:
        yield stub, asyncio.run_coroutine_threadsafe(stub.open(), stub._loop).result()
    finally:
        asyncio.run_coroutine_threadsafe(stub._runner.cleanup(), stub._loop).result()
        stub._loop.call_soon_threadsafe(stub._loop.stop)
        thread.join()
