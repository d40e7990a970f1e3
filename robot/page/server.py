"""The viser server behind the page's door: on the loopback, and for the door alone.

A page of any site open in a browser on this machine may knock at every loopback port with
a websocket, and viser asks nobody where they come from. Whoever does not bring the door's
secret is sent away before a message of theirs is read or one is sent to them.
"""

import contextlib
import hmac

import viser
from viser import _messages, infra
from websockets.exceptions import ConnectionClosed

from robot.page.door import SECRET_HEADER

LOOPBACK = "127.0.0.1"


def open_server(secret: str) -> viser.ViserServer:
    """Open a server on a free loopback port that only takes who brings this secret.

    Raises:
        OSError: there is no free port.
    """
    server = viser.ViserServer(host=LOOPBACK, port=0, label="gazerig", verbose=False)
    inner = server._websock_server

    async def guard(client: infra.WebsockClientConnection) -> None:
        connection = inner._live_connections[client.client_id]
        given = connection.request.headers.get(SECRET_HEADER, "") if connection.request else ""
        if hmac.compare_digest(given.encode(), secret.encode()):
            return
        await connection.close(1008, "come in by the door")
        with contextlib.suppress(ConnectionClosed):
            async for _ in connection:  # what was sent before the refusal is not for anybody
                continue

    inner.on_client_connect(guard)
    # A browser must not be able to put this page on the internet.
    for publish in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        inner.unregister_handler(publish)
    return server
