"""Commands that a message suggests, made ready to be typed: with the rig and port of this one.

Who finds a fault (a driver, the doctor) does not know by which rig and port it was reached;
the command line does. A cure that leaves them out would set up the default rig instead.
"""

import contextlib
import re
import shlex
from collections.abc import Iterator, Mapping
from contextvars import ContextVar

_SUGGESTED = re.compile(
    r"\bgazerig (?P<command>doctor|setup|calibrate|reboot|scan|home)\b"
    r"(?P<words>(?: --fix\b| --joint \w+| --kind \w+|(?<=reboot) \d+)*)"
)
_given: ContextVar[Mapping[str, object]] = ContextVar("given", default={})  # noqa: B039
_TAKE_RIG_AS_OPTION = ("reboot", "scan")


@contextlib.contextmanager
def speaking_of(rig: str | None, port: str | None, mock: bool) -> Iterator[None]:
    """Let messages within the block suggest commands for this rig and port."""
    token = _given.set({"rig": rig, "port": port, "mock": mock})
    try:
        yield
    finally:
        _given.reset(token)


def completed(text: str, given: Mapping[str, object] | None = None) -> str:
    """Return a message in which every suggested command reaches what this command reached.

    Args:
        text: The message.
        given: Parameters of the command that speaks: rig, port, mock; those of the present one
            where None.
    """
    if given is None:
        given = _given.get()
    if "gazerig " not in text or not isinstance(given.get("rig"), str):
        return text
    known = given

    def whole(found: re.Match[str]) -> str:
        named = (f" {shlex.quote(str(known['rig']))}", " --rig ", " --port ")
        if text[found.end() :].startswith(named):
            return found[0]  # it says so itself
        if found["command"] == "reboot" and not found["words"]:
            return found[0]  # told of, not to be typed
        return _command(found["command"], found["words"], known)

    return _SUGGESTED.sub(whole, text)


def _command(command: str, words: str, given: Mapping[str, object]) -> str:
    rig, port, mock = (given.get(name) for name in ("rig", "port", "mock"))
    named = shlex.quote(str(rig))
    more = f" --port {shlex.quote(str(port))}" if isinstance(port, str) else ""
    more += " --mock" if mock is True else ""
    if command == "scan" and mock is not True:
        return f"gazerig scan{words}{more}"
    if command in _TAKE_RIG_AS_OPTION:
        return f"gazerig {command}{words} --rig {named}{more}"
    return f"gazerig {command} {named}{words}{more}"
