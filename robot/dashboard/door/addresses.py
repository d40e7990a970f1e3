"""Names in the addresses that browsers give."""

from urllib.parse import urlsplit


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
