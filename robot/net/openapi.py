"""OpenAPI 3.1 description of the interface for programs, made from the types of its values."""

from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

from gazerig.robot.loop.head_state import HeadReport, HeadState
from gazerig.robot.loop.track_choices import TrackInfo
from gazerig.robot.model.commands import REQUESTS, Request, ShowView, verb
from gazerig.robot.model.parameter import Parameter
from gazerig.robot.model.reply import CommandReply, Outcome
from gazerig.robot.net.topics import PanelContent, Picture, RigInfo, RunState

MOST_RATE_HZ = 25
"""Highest rate of states."""
WAIT_S, MOST_WAIT_S = 10, 15
"""Wait of an HTTP request for an outcome: the usual one and the longest."""
_PATHS = Path(__file__).with_suffix(".json")
"""The description without its messages and types."""
_TAG = {"type": ["string", "integer"], "description": "returned with the answer"}


class ProgramAnswer(msgspec.Struct):
    """The answer to a message.

    Attributes:
        ok: Result; of an order its reply.
        refused: Reason for a refusal.
        failed: Reason for a failure.
        outcome: Outcome of an order, and the reason for it.
        tag: That of the message.
        messages: Number of messages that were dropped as too many.
    """

    ok: Any = None
    refused: str = ""
    failed: str = ""
    outcome: Outcome | None = None
    why: str = ""
    reply: CommandReply | None = None
    tag: str | int = ""
    messages: int = 0


@cache
def api_description() -> dict[str, Any]:
    """Return the OpenAPI description."""
    messages: dict[str, type[Request]] = {**REQUESTS, verb(ShowView): ShowView}
    found, named = msgspec.json.schema_components(
        (*messages.values(), HeadReport, HeadState, ProgramAnswer, RigInfo, RunState, Picture,
         PanelContent, TrackInfo, Parameter),
        ref_template="#/components/schemas/{name}",
    )  # fmt: skip
    for name, kind in messages.items():
        schema = named[kind.__name__]
        schema["title"] = name
        schema["properties"]["tag"] = _TAG
    described: dict[str, Any] = msgspec.json.decode(_PATHS.read_bytes())
    described["info"]["summary"] = f"gazerig {version('gazerig')}"
    described["components"]["schemas"] = named
    do = described["paths"]["/api/v1/do"]["post"]["requestBody"]["content"]["application/json"]
    do["schema"]["oneOf"] = found[: len(messages)]
    return described
