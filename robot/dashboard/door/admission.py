"""Admission of requests to a page, and the addresses of pages.

A client presents a token once, in the query of the first URL; after that a cookie replaces it.
This also applies to clients on this machine, which may have other users. The Origin of every
websocket and of every sent request must be the address of the page. On the loopback that address
must be a name of the loopback; otherwise a foreign name that resolves to this machine would be
accepted (DNS rebinding).
"""

import hmac
import socket
from collections.abc import Mapping
from urllib.parse import urlsplit

from aiohttp import web

_EVERYWHERE = ("0.0.0.0", "::")


def page_url(host: str, port: int) -> str:
    """Return the URL for browsers, with this machine's name if all addresses are served."""
    name = socket.gethostname() if host in _EVERYWHERE else host
    return f"http://[{name}]:{port}" if ":" in name else f"http://{name}:{port}"


def netloc(origin: str) -> str | None:
    """Return host and port of an origin, None if it is not an origin."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None


def hostname(host: str) -> str | None:
    """Return the name in a Host header, None if it has none."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None


LOOPBACK = ("127.0.0.1", "::1", "localhost")


API = "/api/"
"""Prefix of the paths for programs, which present the token with each request."""


_SHOW = (
    "show the token of the page's address as ?token=... or as a header, Authorization: Bearer ...; "
    "without --token-file there is a new one each time the rig is started (gazerig ctl rigs)"
)


def _bearer(request: web.Request) -> str:
    kind, _, token = request.headers.get("Authorization", "").partition(" ")
    return token.strip() if kind.lower() == "bearer" else ""


class Admission:
    """Accepts or refuses requests by one token.

    one_time_token: a second token, which opens the page once; "" for none
    """

    def __init__(self, host: str, port: int, token: str, cookie: str, otherwise: str) -> None:
        """Store what a client must present.

        Args:
            host: address to listen on
            port: its port
            token: token that a client must present
            cookie: name of the cookie that replaces it
            otherwise: what a refused client should do instead
        """
        self._host, self._port = host, port
        self._token, self._cookie = token, cookie
        self._otherwise = otherwise
        self.one_time_token = ""

    def refusal(self, request: web.Request) -> str | None:
        """Return the reason why a request is refused, None if it is accepted."""
        sends = request.method not in ("GET", "HEAD") or "upgrade" in request.headers
        origin = request.headers.get("Origin")
        shown = request.query.get("token") or _bearer(request)
        program = request.path.startswith(API)
        if program and sends and origin is None and not shown:
            return f"refused: {_SHOW}"
        if program and origin == "null" and shown:
            origin = None  # a page opened from a user's file, who gave it the token
        if origin is None and sends and not program:
            return "refused: no Origin; only a browser with this page open may ask for anything"
        if origin is not None and netloc(origin) != request.host:
            return "refused: a page of another origin may not look or ask"
        if self._host in LOOPBACK and hostname(request.host) not in LOOPBACK:
            return f"refused: on this machine the page is at http://{self._host}:{self._port}"
        given = shown or request.cookies.get(self._cookie) or ""
        if hmac.compare_digest(given.encode(errors="replace"), self._token.encode()):
            return None
        if (
            self.one_time_token
            and not program
            and hmac.compare_digest(given.encode(errors="replace"), self.one_time_token.encode())
        ):
            self.one_time_token = ""
            return None
        return f"refused: {_SHOW if program else self._otherwise}"

    def with_cookie(self, request: web.Request, headers: Mapping[str, str]) -> web.Response:
        """Move the token from the address to a cookie, which is not shown, stored or forwarded."""
        clean = request.rel_url.without_query_params("token").raw_path_qs
        # "//elsewhere" is the address of another machine, and so is "/\elsewhere".
        there = "/" + clean.lstrip("/\\")
        answer = web.Response(status=302, headers={**headers, "Location": there})
        answer.set_cookie(self._cookie, self._token, httponly=True, samesite="Strict", path="/")
        return answer
