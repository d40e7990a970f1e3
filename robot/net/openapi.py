"""OpenAPI 3.1 description of the interface for programs, made from the types of its values."""

from functools import cache
from importlib.metadata import version
from typing import Any

import msgspec

from gazerig.robot.loop.head_state import HeadReport, HeadState
from gazerig.robot.loop.track_choices import TrackInfo
from gazerig.robot.model.commands import REQUESTS, Request, ShowView, verb
from gazerig.robot.model.parameter import Parameter
from gazerig.robot.model.reply import CommandReply, Outcome
from gazerig.robot.net.socket_io import VERSION
from gazerig.robot.net.topics import PanelContent, Picture, RigInfo, RunState

Schema = dict[str, Any]
MOST_RATE_HZ = 25
"""Highest rate of states."""
WAIT_S, MOST_WAIT_S = 10, 15
"""Wait of an HTTP request for an outcome: the usual one and the longest."""
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


def message_schemas() -> tuple[list[Schema], dict[str, Schema]]:
    """Return a reference for each message of a program, and the schemas of all types."""
    messages: dict[str, type[Request]] = {**REQUESTS, verb(ShowView): ShowView}
    found, named = msgspec.json.schema_components(
        (*messages.values(), HeadReport, HeadState, ProgramAnswer, RigInfo, RunState, Picture,
         PanelContent, TrackInfo, Parameter),
        ref_template="#/components/schemas/{name}",
    )  # fmt: skip
    requests = list(found[: len(messages)])
    for name, kind in messages.items():
        schema = named[str(kind.__name__)]
        schema["title"] = name
        schema["properties"]["tag"] = _TAG
    return requests, named


@cache
def api_description(base: str) -> Schema:
    """Return the OpenAPI description; ``base`` is the beginning of the paths."""
    requests, named = message_schemas()
    of_answer = {"$ref": "#/components/schemas/ProgramAnswer"}
    report: Schema = {"ok": {"$ref": "#/components/schemas/HeadReport"}}
    refusals = {
        code: _response(what, of_answer)
        for code, what in {
            "400": "Not a message", "403": "Wrong token or another site", "409": "Refused",
            "413": "Too long", "429": "Too many requests", "503": "No head accepts requests",
        }.items()
    }  # fmt: skip
    bad = {code: refusals[code] for code in ("400", "403", "429", "503")}
    operations: dict[str, tuple[str, str, dict[str, Schema], Schema]] = {
        "state": (
            "get",
            "Newest state of the head; events numbered above after",
            {"after": {"type": "integer", "minimum": 0}},
            {"200": _response("State", {"type": "object", "properties": report}), **bad},
        ),
        "do": (
            "post",
            "Send one message; the answer to an order has its outcome",
            {"wait_s": {"type": "number", "minimum": 0, "maximum": MOST_WAIT_S, "default": WAIT_S}},
            {"200": _response("Done", of_answer), **refusals},
        ),
        "socket": (
            "get",
            "Websocket: messages as in do, answers and outcomes; states at rate_hz; events; "
            "pictures, each followed by its JPEG; rig, run and panels",
            {
                "rate_hz": {"type": "number", "minimum": 1, "maximum": MOST_RATE_HZ},
                **{name: {"type": "boolean", "default": False} for name in ("events", "pictures", "rig")},
            },
            {"101": {"description": "Open"}, **bad},
        ),
        "waveform": (
            "get",
            "Outline of a track's sound, 0..1",
            {"track": {"type": "string"}},
            {"200": _response("Outline", of_answer), **bad, "404": _response("No sound", of_answer)},
        ),
        "openapi.json": (
            "get", "This description", {}, {"200": _response("OpenAPI 3.1", {"type": "object"})},
        ),
    }  # fmt: skip
    paths: dict[str, Schema] = {
        f"{base}/{name}": {
            method: {
                "summary": text,
                "parameters": [
                    {"name": key, "in": "query", "required": False, "schema": schema}
                    for key, schema in queries.items()
                ],
                "responses": answers,
            }
        }
        for name, (method, text, queries, answers) in operations.items()
    }
    body = {"required": True, **_json_content({"oneOf": requests})}
    paths[f"{base}/do"]["post"]["requestBody"] = body
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "gazerig",
            "version": f"{VERSION}.0.0",
            "summary": f"gazerig {version('gazerig')}",
            "description": "Control of a running head by programs in any language.",
        },
        "paths": paths,
        "components": {
            "schemas": named,
            "securitySchemes": {
                "bearer": {"type": "http", "scheme": "bearer"},
                "token": {"type": "apiKey", "in": "query", "name": "token"},
            },
        },
        "security": [{"bearer": []}, {"token": []}],
    }


def _json_content(schema: Schema) -> Schema:
    return {"content": {"application/json": {"schema": schema}}}


def _response(description: str, schema: Schema) -> Schema:
    return {"description": description, **_json_content(schema)}
