"""Metadata of a recorded run: settings at its start and its end; stored as text."""

import importlib.metadata
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from typing import Any

FORMAT = 1
"""Version of the message contents; it increases when an older reader would misinterpret them."""
PROFILE = "gazerig-run-1"
"""MCAP profile of recordings of runs."""


@dataclass(frozen=True, slots=True)
class RunInfo:
    """Settings at the start of a run.

    Attributes:
        rig, profile, character: Names or paths from the command line.
        config_yaml: The complete configuration at the start.
        seed: Seed of the random numbers.
        rate_hz: Control rate at the start.
        started_utc: Wall clock at the start, ISO 8601.
        walk_yaml: The face walk's file.
        tracks_yaml: The tracks that the rig defines, "" if it defines none.
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
    seed: int
    rate_hz: float
    started_utc: str
    character: str | None = None
    walk_yaml: str = ""
    tracks_yaml: str = ""
    scene: str | None = None
    eyes: str = ""
    mock: bool = False
    fast: bool = False
    bus: str = "emulated"
    pictures_hz: float = 0.0
    versions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RunEnd:
    """The end of a run; fields that the program did not write have their defaults.

    Attributes:
        stopped_by: "seconds", a signal, a fault; "" if the program was killed.
        lost: Number of ticks that were not recorded.
        ran_s: Time from the start of the loop to the slot at which it ended.
        tx_sha256: Hash of all bytes sent to an emulated bus in simulated time, otherwise "".
    """

    stopped_by: str = ""
    lost: int = 0
    ran_s: float | None = None
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
    """Return the wall clock at the start in nanoseconds since 1970.

    Raises:
        ValueError: It is not a time in ISO 8601.
    """
    return round(datetime.fromisoformat(info.started_utc).timestamp() * 1e6) * 1000


def as_text(value: RunInfo | RunEnd) -> dict[str, str]:
    """Return the fields as MCAP metadata: YAML unchanged, everything else as JSON."""
    plain = asdict(value)
    return {k: v if k.endswith("_yaml") else json.dumps(v) for k, v in plain.items()}


def read_run_info(text: Mapping[str, str]) -> RunInfo:
    """Read the settings of a run that ``as_text`` wrote.

    Raises:
        ValueError: A field is missing, is not JSON or has an impossible value.
    """
    found = _read_fields(text, {f.name for f in fields(RunInfo)})
    try:
        info = RunInfo(**found)
    except TypeError as error:
        raise ValueError(str(error)) from None
    texts = ("rig", "profile", "config_yaml", "walk_yaml", "tracks_yaml", "eyes", "bus")
    optional = [key for key in ("character", "scene") if getattr(info, key) is not None]
    if not all(isinstance(getattr(info, key), str) for key in (*texts, *optional)):
        raise ValueError("a name of the run is not text")
    if not (_is_within(info.rate_hz, 1.0, 10_000.0) and _is_within(info.pictures_hz, 0.0, 1000.0)):
        raise ValueError(f"a control rate of {info.rate_hz} Hz")
    if type(info.seed) is not int or info.seed < 0:
        raise ValueError(f"the seed {info.seed}")
    if type(info.mock) is not bool or type(info.fast) is not bool:
        raise ValueError("mock or fast is not a boolean")
    if not isinstance(info.versions, dict):
        raise ValueError("no versions")
    started_ns(info)
    return info


def _is_within(value: object, low: float, high: float) -> bool:
    return type(value) in (int, float) and low <= value <= high  # type: ignore[operator]


def read_run_end(text: Mapping[str, str]) -> RunEnd:
    """Read the end of a run that ``as_text`` wrote.

    Raises:
        ValueError: A field is not JSON or has an impossible value.
    """
    end = RunEnd(**_read_fields(text, {f.name for f in fields(RunEnd)}))
    if not isinstance(end.stopped_by, str) or not isinstance(end.tx_sha256, str):
        raise ValueError("a field of the end is not text")
    if type(end.lost) is not int or not (end.ran_s is None or _is_within(end.ran_s, 0.0, 1e9)):
        raise ValueError("a field of the end is not a number")
    return end


def _read_fields(text: Mapping[str, str], names: set[str]) -> dict[str, Any]:
    """Read the fields that this version supports."""
    known = {key: value for key, value in text.items() if key in names}
    return {k: v if k.endswith("_yaml") else json.loads(v) for k, v in known.items()}
