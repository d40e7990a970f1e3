"""Requests of browsers to the rig through the page's door: small, checked JSON objects."""

import json
from collections.abc import Mapping

from gazerig.robot.model.commands import COMMANDS, Leading
from gazerig.robot.remote.socket_io import parse_json

ASKED_BYTES = 2048
"""Longest request, bytes; a stop with its reason has a hundred."""

_LEADING = frozenset(name for name, kind in COMMANDS.items() if issubclass(kind, Leading))
_SAY_WHO = tuple(name for name, kind in COMMANDS.items() if "who" in kind._fields)
"""Commands with the name of the client."""


def from_browser(body: bytes | str, who: str) -> dict[str, object] | None:
    """Return a request with the browser's name written in, None if it is not valid.

    Args:
        body: as it came
        who: the name of the browser; what it calls itself in the request is overwritten
    """
    try:
        asked = parse_json(body)
    except (ValueError, RecursionError):
        return None
    if not isinstance(asked, dict):
        return None
    if (name := asked.get("do")) in _SAY_WHO:
        asked = {"do": name, **asked, "who": who}
    if isinstance(pick := asked.get("pick"), dict):
        asked["pick"] = {**pick, "who": who}
    return asked


def leads(asked: Mapping[str, object]) -> bool:
    """Return whether a request gives its browser control of the head."""
    return "pick" in asked or asked.get("do") in _LEADING


def compact(asked: Mapping[str, object]) -> bytes:
    """Return a request as JSON without blanks, its "do" first."""
    return json.dumps(asked, separators=(",", ":")).encode()
