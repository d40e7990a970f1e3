"""Commands that a message suggests, made ready to be typed: with the rig and port of this one.

A driver or the doctor that finds a fault does not know the rig and port of the command;
the command line does. A cure that leaves them out would set up the default rig instead.
"""

import contextlib
import re
import shlex
from collections.abc import Iterator, Mapping

_SUGGESTED = re.compile(
    r"\bgazerig (?P<command>doctor|setup|calibrate|reboot|scan|home)\b"
    r"(?P<words>(?: --fix\b| --joint \w+| --kind \w+|(?<=reboot) \d+)*)"
)
_given: list[Mapping[str, object]] = [{}]
"""Of the command in force, last; for all threads, as those that watch a run speak, too."""


@contextlib.contextmanager
def speaking_of(rig: str | None, port: str | None, mock: bool) -> Iterator[None]:
    """Make messages within the block suggest commands for this rig and port.

    A block that names no rig speaks of the one around it.
    """
    _given.append({"rig": rig, "port": port, "mock": mock} if rig is not None else _given[-1])
    try:
        yield
    finally:
        _given.pop()


def with_doctor(text: str) -> str:
    """Return a fault of servos with the command that finds its cause, where none is named yet."""
    given = _given[-1]
    reaches = isinstance(given.get("rig"), str) and given.get("mock") is not True
    return f"{text}; gazerig doctor finds the cause" if reaches and "gazerig " not in text else text


def completed(text: str, given: Mapping[str, object] | None = None) -> str:
    """Return a message in which every suggested command reaches what this command reached.

    Args:
        text: The message.
        given: Parameters of the command that speaks: rig, port, mock; those of the present one
            where None.
    """
    if given is None:
        given = _given[-1]
    if "gazerig " not in text or not isinstance(given.get("rig"), str):
        return text
    known = given

    def whole(found: re.Match[str]) -> str:
        if text[found.end() :].startswith((f" {shlex.quote(str(known['rig']))}", " --port ")):
            return found[0]  # its message is complete
        if found["command"] == "reboot" and not found["words"]:
            return found[0]  # a description, not a command
        port, mock = known.get("port"), known.get("mock") is True
        more = f" --port {shlex.quote(str(port))}" if isinstance(port, str) else ""
        more += " --mock" if mock else ""
        scans = found["command"] == "scan" and not mock
        named = "" if scans else f" {shlex.quote(str(known['rig']))}"
        return f"gazerig {found['command']}{named}{found['words']}{more}"

    return _SUGGESTED.sub(whole, text)
