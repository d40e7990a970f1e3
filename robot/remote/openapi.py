"""OpenAPI 3.1 description of the interface for programs, derived from the types of its values."""

import inspect
import types
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from importlib.metadata import version
from typing import Any, ForwardRef, Literal, Union, get_args, get_origin, get_type_hints

from gazerig.robot.control.command_handler import CHANGES, ORDERS, QUESTIONS
from gazerig.robot.control.head_state import HeadEvent, HeadState
from gazerig.robot.model.outcome import Outcome
from gazerig.robot.remote.socket_io import VERSION

Schema = dict[str, Any]
MOST_RATE_HZ = 60
"""Highest rate of states."""
WAIT_S, MOST_WAIT_S = 10, 15
"""Wait of an HTTP request for an outcome: the usual one and the longest."""
_PLAIN = {bool: "boolean", int: "integer", float: "number", str: "string", type(None): "null"}
_REQUESTS = QUESTIONS | CHANGES


class Schemas:
    """JSON Schemas of types; those with names are collected.

    Attributes:
        named: name -> schema of each class.
    """

    def __init__(self) -> None:
        self.named: dict[str, Schema] = {}

    def schema(self, kind: Any) -> Schema:
        """Return the schema of a type; values of a rig file may be anything."""
        origin, inner = get_origin(kind), get_args(kind)
        if kind in _PLAIN:
            return {"type": _PLAIN[kind]}
        if is_dataclass(kind) or hasattr(kind, "_fields"):
            return self._reference(kind)
        if origin is Literal:
            return {"enum": list(inner)}
        if origin in (Union, types.UnionType):
            return {"anyOf": [self.schema(one) for one in inner]}
        if origin is tuple and inner[-1] is not ...:
            each = [self.schema(one) for one in inner]
            return {"type": "array", "prefixItems": each, "minItems": len(each), "items": False}
        if origin is tuple:
            return {"type": "array", "items": self.schema(inner[0])}
        if inner and issubclass(origin, Mapping):
            return {"type": "object", "additionalProperties": self.schema(inner[1])}
        if isinstance(kind, ForwardRef | str):  # the recursive Value
            return {}
        raise TypeError(f"no schema for {kind}")

    def _reference(self, kind: Any) -> Schema:
        if kind.__name__ not in self.named:
            self.named[kind.__name__] = {}  # for a type within itself
            properties, needed = self.fields(kind)
            self.named[kind.__name__] = {
                "type": "object",
                "description": inspect.getdoc(kind) or "",
                "properties": properties,
                "required": needed,
            }
        return {"$ref": f"#/components/schemas/{kind.__name__}"}

    def fields(self, kind: Any) -> tuple[Schema, list[str]]:
        """Return the schemas of a class's fields, and the names of those without defaults."""
        hints = get_type_hints(kind)
        if is_dataclass(kind):
            optional = {f.name for f in fields(kind) if f.default is not MISSING}
            names = [f.name for f in fields(kind)]
        else:
            optional, names = set(kind._field_defaults), list(kind._fields)
        found = {name: self.schema(hints[name]) for name in names}
        return found, [name for name in names if name not in optional]


def _message_schema(name: str, description: str, properties: Schema, needed: list[str]) -> Schema:
    tag = {"type": ["string", "integer"], "description": "returned with the answer"}
    return {
        "title": name,
        "type": "object",
        "description": description,
        "properties": {"do": {"const": name}, **properties, "tag": tag},
        "required": ["do", *needed],
        "additionalProperties": False,
    }


def message_schemas(schemas: Schemas) -> dict[str, Schema]:
    """Return the schema of each message of a program, by its verb."""
    found = {}
    for name, (text, kinds) in _REQUESTS.items():
        properties = {field: schemas.schema(kind) for field, kind in kinds.items()}
        found[name] = _message_schema(name, text, properties, list(properties))
    for name, kind in ORDERS.items():
        found[name] = _message_schema(name, inspect.getdoc(kind) or "", *schemas.fields(kind))
    return found


@cache
def api_description(base: str) -> dict[str, Any]:
    """Return the OpenAPI description; ``base`` is the beginning of the paths."""
    schemas = Schemas()
    state, event, outcome = (
        schemas.schema(HeadState),
        schemas.schema(HeadEvent),
        schemas.schema(Outcome),
    )
    requests = message_schemas(schemas)
    text = {"type": "string"}
    answer: Schema = {
        "type": "object",
        "properties": {
            "ok": {}, "refused": text, "failed": text, "outcome": outcome, "why": text,
            "tag": {"type": ["string", "integer"]}, "messages": {"type": "integer"},
        },
    }  # fmt: skip
    named = {**schemas.named, **requests, "Answer": answer}
    of_answer = {"$ref": "#/components/schemas/Answer"}
    refusals = {
        code: _response(what, of_answer)
        for code, what in {
            "400": "Not a message", "403": "Wrong token or another site", "409": "Refused",
            "413": "Too long", "429": "Too many requests", "503": "No head accepts requests",
        }.items()
    }  # fmt: skip
    bad = {code: refusals[code] for code in ("400", "403", "429", "503")}
    body = {"oneOf": [{"$ref": f"#/components/schemas/{name}"} for name in requests]}
    now = {
        "type": "object",
        "properties": {
            "state": {"anyOf": [state, {"type": "null"}]},
            "events": {"type": "array", "items": event},
            "number": {"type": "integer", "description": "number of the newest event"},
        },
    }
    operations: dict[str, tuple[str, str, list[Schema], Schema]] = {
        "state": (
            "get",
            "Newest state of the head; events numbered above after",
            [_query_parameter("after", {"type": "integer", "minimum": 0})],
            {"200": _response("State", {"type": "object", "properties": {"ok": now}}), **bad},
        ),
        "do": (
            "post",
            "Send one message; the answer to an order has its outcome",
            [_query_parameter("wait_s", {"type": "number", "minimum": 0, "maximum": MOST_WAIT_S, "default": WAIT_S})],
            {"200": _response("Done", of_answer), **refusals},
        ),
        "socket": (
            "get",
            "Websocket: messages as in do, answers and outcomes; states at rate_hz; events",
            [
                _query_parameter("rate_hz", {"type": "number", "minimum": 1, "maximum": MOST_RATE_HZ}),
                _query_parameter("events", {"type": "boolean", "default": False}),
            ],
            {"101": {"description": "Open"}, **bad},
        ),
        "openapi.json": (
            "get", "This description", [], {"200": _response("OpenAPI 3.1", {"type": "object"})},
        ),
    }  # fmt: skip
    paths: dict[str, Schema] = {
        f"{base}/{name}": {method: {"summary": text, "parameters": queries, "responses": answers}}
        for name, (method, text, queries, answers) in operations.items()
    }
    paths[f"{base}/do"]["post"]["requestBody"] = {"required": True, **_json_content(body)}
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


def _query_parameter(name: str, schema: Schema) -> Schema:
    return {"name": name, "in": "query", "required": False, "schema": schema}
