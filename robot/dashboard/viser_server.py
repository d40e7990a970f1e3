"""The viser server behind the page's door: on a Unix socket that no other user can reach.

Viser authenticates no client. On a port of the loopback every user of the machine, and every
page that is open in a browser here, could talk to it past the door.
"""

import contextlib
import functools
from collections.abc import Iterator
from pathlib import Path

import viser
import websockets.asyncio.server as websocket_server
from viser import _messages, transforms

from gazerig.robot.dashboard.pointer_to_look import ViewCamera

BROWSER_HEADER = "X-Gazerig-Browser"
"""Says to the server which browser a websocket is of."""
TO_BROWSER_BYTES = 1 << 25
"""No message to a browser is longer."""
FROM_BROWSER_BYTES = 1 << 20
"""No message from a browser is longer: the longest that the page's script sends has some kB."""


def open_server(socket_path: Path) -> viser.ViserServer:
    """Open a server on a new Unix socket, in a folder that is its user's alone.

    Raises:
        OSError: the socket cannot be made.
    """
    with _on_unix_socket(socket_path):
        server = viser.ViserServer(host="127.0.0.1", port=0, label="gazerig", verbose=False)
    # A browser must not be able to put this page on the internet.
    for publish in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(publish)
    return server


def browser_of(server: viser.ViserServer, client_id: int) -> str:
    """Return which browser a client of the server is, "" where that is not known."""
    connection = server._websock_server._live_connections.get(client_id)
    if connection is None or connection.request is None:
        return ""
    return connection.request.headers.get(BROWSER_HEADER, "")


def camera_of(server: viser.ViserServer, browser: str) -> ViewCamera | None:
    """Return from where a browser sees the scene in its newest tab; None: it does not see it."""
    for client_id, client in sorted(server.get_clients().items(), reverse=True):
        if browser_of(server, client_id) == browser:
            seen = client.camera
            x, y, z = seen.position.tolist()
            R = transforms.SO3(seen.wxyz).as_matrix().tolist()
            return ViewCamera((x, y, z), (tuple(R[0]), tuple(R[1]), tuple(R[2])), float(seen.fov))
    return None


@contextlib.contextmanager
def _on_unix_socket(path: Path) -> Iterator[None]:
    """Within the block, make viser's server, which supports only ports, listen on a socket file."""
    serve = websocket_server.serve

    @functools.wraps(serve)
    def at_path(handler: object, host: str, port: int, **settings: object) -> object:
        settings["max_size"] = FROM_BROWSER_BYTES
        return serve(handler, unix=True, path=str(path), **settings)  # type: ignore[arg-type]

    websocket_server.serve = at_path  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websocket_server.serve = serve  # type: ignore[misc]
