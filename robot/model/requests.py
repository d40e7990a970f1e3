"""Requests to a running rig besides commands: questions, and changes of its parameters.

Each is one class: all interfaces decode it, and the description of the network's interface is made
from it.
"""

from typing import Annotated, Any, Literal, get_args

import msgspec
from msgspec import Meta, structs

from gazerig.robot.model.commands import (
    COMMANDS,
    AnyCommand,
    Command,
    Request,
    Speak,
    Tune,
    verb,
)


class Hello(Request, frozen=True):
    """Check the version of the messages; return the rig's identity."""

    version: int


class ReadStatus(Request, frozen=True, tag="status"):
    """Name and state of the rig, and its last messages."""


class State(Request, frozen=True):
    """Newest tick, and the events numbered above after."""

    after: int = 0


class ReadMenus(Request, frozen=True, tag="menus"):
    """Behaviours, modes of conversation, lid movements; the present one first."""


class Tracks(Request, frozen=True):
    """Tracks, and why the rig refuses them."""


class Parameters(Request, frozen=True):
    """Rules and defaults of keys with a prefix."""

    prefix: str = ""


class Get(Request, frozen=True):
    """Present values of keys with a prefix."""

    prefix: str = ""


class Unsaved(Request, frozen=True):
    """Values that differ from the rig's file."""


class Characters(Request, frozen=True):
    """Names of characters."""


class Set(Request, frozen=True):
    """Apply values of keys, all of them or none."""

    changes: dict[str, Any]


class Save(Request, frozen=True):
    """Write the values to the rig's file, or to an absolute path."""

    path: str | None = None


class Revert(Request, frozen=True):
    """Apply the values of the rig's file again."""


class Character(Request, frozen=True):
    """Apply another character to the rig."""

    name: str


class SayPiece(Request, frozen=True):
    """Say a piece of a stream, base64 of signed 16 bits; returns the unheard length in s."""

    pcm: bytes
    rate_hz: int
    channels: int = 1
    last: bool = False
    volume: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0


class Fault(Request, frozen=True):
    """Execute a fault command of emulated servos (gazerig emulate)."""

    text: str


Layer = Literal["sight"]
Viewpoint = Literal["face", "both", "over its shoulder", "from above"]


class ShowView(Request, frozen=True):
    """Choose what the page's view of the head shows; the page does it, not the rig.

    Attributes:
        layers: Layers for all browsers, None for no change: lines of sight.
        look_from: Viewpoint of this browser, None for no change.
    """

    layers: tuple[Layer, ...] | None = None
    look_from: Viewpoint | None = None


Question = (
    Hello | ReadStatus | State | ReadMenus | Tracks | Parameters | Get | Unsaved | Characters
)  # fmt: skip
Change = Set | Save | Revert | Character | SayPiece | Fault
SLOW: frozenset[str] = frozenset((*map(verb, get_args(Change)), "say"))
"""Requests that may read or write files."""
ORDERS: dict[str, type[Command]] = {
    name: kind for name, kind in COMMANDS.items() if kind not in (Tune, Speak)
}
"""Commands that programs may send; the requests set and say check and prepare the others."""
REQUESTS: dict[str, type[Request]] = {
    verb(kind): kind for kind in (*get_args(Question | Change), *ORDERS.values())
}


def read_request(data: object) -> Request:
    """Return a request from the values of its JSON; fields with defaults may be omitted.

    Raises:
        ValueError: It is not a request; the message names the place, the rule and the fields.
    """
    try:
        request: Request = msgspec.convert(data, Question | Change | AnyCommand)
    except msgspec.ValidationError as error:
        kind = REQUESTS.get(str(data.get("do"))) if isinstance(data, dict) else None
        if kind is None:
            raise ValueError(f"unknown request; available: {', '.join(REQUESTS)}") from None
        raise ValueError(f"{error}; {_fields_text(kind)}") from None
    if isinstance(request, Tune | Speak):
        raise ValueError("this is done by the requests set and say, which check it")
    return request


def _fields_text(kind: type[Request]) -> str:
    """Return the names of a request's fields, with their choices."""
    fields = []
    for field in structs.fields(kind):
        choices = ", ".join(str(one) for one in get_args(field.type) if isinstance(one, str))
        fields.append(f"{field.name} ({choices})" if choices else field.name)
    return f"{verb(kind)} has {', '.join(fields) or 'no fields'}"
