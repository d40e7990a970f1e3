"""Host names and origins in the addresses of browsers."""

import socket
from urllib.parse import urlsplit

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
