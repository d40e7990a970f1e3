"""Viser server behind the page's door, on a Unix socket that no other user can reach.

Viser authenticates no client. On a port of the loopback every user of the machine, and every
page that is open in a browser here, could talk to it past the door.
"""

import contextlib
import functools
import hmac
import http
import secrets
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import viser
import websockets.asyncio.server as websocket_server
from viser import _messages, transforms

from gazerig.robot.dashboard.requests.pointer_to_look import ViewCamera

BROWSER_HEADER = "X-Gazerig-Browser"
"""Header with the name of a websocket's browser."""
KEY_HEADER = "X-Gazerig-Key"
"""Header with the key by which a server on a port recognises the door."""
HAS_SOCKET_FILES = hasattr(socket, "AF_UNIX")
TO_BROWSER_BYTES = 1 << 25
"""Longest message to a browser, bytes."""
FROM_BROWSER_BYTES = 1 << 20
"""Longest message from a browser, bytes; those of the page's script have some kB."""


class ViewAddress(NamedTuple):
    """Address of the server, for the door.

    path: of its Unix socket; None: it listens on a port of the loopback
    key: what must be shown there with each request, as others could reach a port
    """

    path: Path | None
    port: int = 0
    key: str = ""


def open_server(socket_path: Path) -> tuple[viser.ViserServer, ViewAddress]:
    """Open a server on a new Unix socket, in a folder of this user only.

    On a system without such sockets it uses a port of the loopback and answers only with a key.

    Raises:
        OSError: the socket cannot be made.
    """
    inside = ViewAddress(socket_path)
    if not HAS_SOCKET_FILES:
        inside = ViewAddress(None, key=secrets.token_hex(16))
    with _listening_inside(inside):
        server = viser.ViserServer(host="127.0.0.1", port=0, label="gazerig", verbose=False)
    if inside.path is None:
        inside = inside._replace(port=server.get_port())
    # A browser must not be able to publish this page on the internet.
    for publish in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(publish)
    return server, inside


def browser_of(server: viser.ViserServer, client_id: int) -> str:
    """Return the name of a client's browser, "" if unknown."""
    connection = server._websock_server._live_connections.get(client_id)
    if connection is None or connection.request is None:
        return ""
    return connection.request.headers.get(BROWSER_HEADER, "")


def camera_of(server: viser.ViserServer, browser: str) -> ViewCamera | None:
    """Return the camera of a browser's newest tab, None if it does not show the scene."""
    for client_id, client in sorted(server.get_clients().items(), reverse=True):
        if browser_of(server, client_id) == browser:
            seen = client.camera
            x, y, z = seen.position.tolist()
            R = transforms.SO3(seen.wxyz).as_matrix().tolist()
            return ViewCamera((x, y, z), (tuple(R[0]), tuple(R[1]), tuple(R[2])), float(seen.fov))
    return None


@contextlib.contextmanager
def _listening_inside(inside: ViewAddress) -> Iterator[None]:
    """Within the block, make viser's server, which supports only ports, listen only for the door.

    It listens on a socket file, or on its port for requests with the key.
    """
    serve = websocket_server.serve

    @functools.wraps(serve)
    def for_the_door(handler: object, host: str, port: int, **settings: Any) -> object:
        settings["max_size"] = FROM_BROWSER_BYTES
        if inside.path is not None:
            return serve(handler, unix=True, path=str(inside.path), **settings)  # type: ignore[arg-type]
        settings["process_request"] = _for_key(inside.key, settings["process_request"])
        return serve(handler, host, port, **settings)  # type: ignore[arg-type]

    websocket_server.serve = for_the_door  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websocket_server.serve = serve  # type: ignore[misc]


def _for_key(key: str, answer: Callable[..., Any]) -> Callable[..., Any]:
    """Return a handler that answers as ``answer`` does if a request has the key."""

    def checked(connection: Any, request: Any) -> Any:
        if not hmac.compare_digest(request.headers.get(KEY_HEADER, "").encode(), key.encode()):
            return connection.respond(http.HTTPStatus.FORBIDDEN, "")
        return answer(connection, request)

    return checked
