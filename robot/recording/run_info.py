"""Metadata of a recorded run: settings at its start and its end; stored as text."""

import importlib.metadata
import platform
from datetime import datetime
from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta, Struct

T = TypeVar("T")
FORMAT = 2
"""Version of the message contents; only this one is read."""
PROFILE = f"gazerig-run-{FORMAT}"
"""MCAP profile of recordings of runs."""


class RunInfo(Struct, frozen=True):
    """Settings at the start of a run.

    Attributes:
        rig, profile, character: Names or paths from the command line.
        config_yaml: The complete configuration at the start.
        seed: Seed of the random numbers.
        rate_hz: Control rate at the start.
        started_utc: Wall clock at the start.
        walk_yaml: The face walk's file.
        tracks: The files of the rig's own tracks by name.
        scene: The simulated scene, None with a camera.
        eyes: Description of the camera.
        mock: Whether the servos were emulated.
        fast: Whether time was simulated.
        bus: "ideal" for emulated servos without bytes, "emulated" for those with bytes.
        pictures_hz: Rate of the recorded frames.
        versions: Name -> version of the packages that affect the arithmetic.
    """

    rig: str
    profile: str
    config_yaml: str
    seed: Annotated[int, Meta(ge=0)]
    rate_hz: Annotated[float, Meta(ge=1.0, le=10_000.0)]
    started_utc: Annotated[datetime, Meta(tz=True)]
    character: str | None = None
    walk_yaml: str = ""
    tracks: dict[str, str] = {}
    scene: str | None = None
    eyes: str = ""
    mock: bool = False
    fast: bool = False
    bus: str = "emulated"
    pictures_hz: Annotated[float, Meta(ge=0.0, le=1000.0)] = 0.0
    versions: dict[str, str] = {}


class RunEnd(Struct, frozen=True):
    """The end of a run; fields that the program did not write have their defaults.

    Attributes:
        stopped_by: "seconds", a signal, a fault; "" if the program was killed.
        lost: Number of ticks that were not recorded.
        ran_s: Time from the start of the loop to the slot at which it ended.
        tx_sha256: Hash of all bytes sent to an emulated bus in simulated time, otherwise "".
    """

    stopped_by: str = ""
    lost: int = 0
    ran_s: Annotated[float, Meta(ge=0.0, le=1e9)] | None = None
    tx_sha256: str = ""


def versions() -> dict[str, str]:
    """Return the versions of Python, of this package and of the packages for its arithmetic."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for package in ("gazerig", "numpy", "scipy", "opencv-contrib-python-headless"):
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed as a package"
    return found


def started_ns(info: RunInfo) -> int:
    """Return the wall clock at the start in nanoseconds since 1970."""
    return round(info.started_utc.timestamp() * 1e6) * 1000


def as_text(value: RunInfo | RunEnd) -> dict[str, str]:
    """Return settings as MCAP metadata."""
    return {_KEY: msgspec.json.encode(value).decode()}


def read_text(text: dict[str, str], kind: type[T]) -> T:
    """Return the settings that ``as_text`` wrote.

    Raises:
        KeyError, ValueError: The text is missing, damaged or has an impossible value.
    """
    return msgspec.json.decode(text[_KEY], type=kind)


_KEY = "json"
