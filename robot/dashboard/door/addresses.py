"""Names in the addresses that browsers give and are given."""

import socket
from urllib.parse import urlsplit

_EVERYWHERE = ("0.0.0.0", "::")


def page_url(host: str, port: int) -> str:
    """Return where browsers find what is served, by this machine's name if it is everywhere."""
    name = socket.gethostname() if host in _EVERYWHERE else host
    return f"http://[{name}]:{port}" if ":" in name else f"http://{name}:{port}"


def netloc(origin: str) -> str | None:
    """Return host and port of an origin, None where it is none."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None


def hostname(host: str) -> str | None:
    """Return the name alone of what a browser calls a host, None where it is none."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None
