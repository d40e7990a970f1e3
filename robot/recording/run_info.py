"""What should be known of a recorded run beside its ticks; kept in the recording as text."""

import importlib.metadata
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from typing import Any

from gazerig.robot.recording.world_info import WorldInfo

FORMAT = 1
"""Version of what the messages hold; goes up when an older reader would misread them."""
PROFILE = "gazerig-run-1"
"""MCAP profile of recordings of runs."""


@dataclass(frozen=True, slots=True)
class RunInfo:
    """A run as it was started.

    rig, profile, character: names as given on the command line, or paths
    config_yaml: everything in force at the start, of one piece; walk_yaml: the face walk's file
    gestures_yaml: the gestures that the rig names itself, "" where it names none
    scene: what was simulated, None where a camera looked; eyes: what looked, in words
    mock: emulated servos; fast: simulated time
    bus: "ideal" where the emulated servos had no bytes, "emulated" where they had
    rate_hz: control rate at the start; pictures_hz: rate of the recorded frames
    started_utc: wall clock at the start, ISO 8601
    versions: name -> version of the packages whose arithmetic counts
    stands: of a head in a world with others, where its neck base stands there: place (3, metres),
        then the rows of its rotation (9); () for a head that is alone
    """

    rig: str
    profile: str
    config_yaml: str
    seed: int
    rate_hz: float
    started_utc: str
    character: str | None = None
    walk_yaml: str = ""
    gestures_yaml: str = ""
    scene: str | None = None
    eyes: str = ""
    mock: bool = False
    fast: bool = False
    bus: str = "emulated"
    pictures_hz: float = 0.0
    versions: Mapping[str, str] = field(default_factory=dict)
    stands: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class RunEnd:
    """How a run ended, as the program said it; what it did not say is at its default.

    stopped_by: "seconds", a signal, a fault; "" where the program was killed
    lost: ticks that could not be kept
    ran_s: time from the start of the loop to the slot at which it ended
    tx_sha256: of all bytes sent to an emulated bus in simulated time, else ""
    """

    stopped_by: str = ""
    lost: int = 0
    ran_s: float | None = None
    tx_sha256: str = ""


def versions() -> dict[str, str]:
    """Return the versions of Python, of this package and of those that do its arithmetic."""
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
        ValueError: it is no time of ISO 8601.
    """
    return round(datetime.fromisoformat(info.started_utc).timestamp() * 1e6) * 1000


def as_text(value: RunInfo | RunEnd | WorldInfo) -> dict[str, str]:
    """Return the fields as MCAP metadata: YAML as it is, all else as JSON."""
    plain = asdict(value)
    return {k: v if k.endswith("_yaml") else json.dumps(v) for k, v in plain.items()}


def info_of(text: Mapping[str, str]) -> RunInfo:
    """Read what ``as_text`` gave of a run's beginning.

    Raises:
        ValueError: something is missing or no JSON.
    """
    found = _read(text, {f.name for f in fields(RunInfo)})
    if isinstance(found.get("stands"), list):
        found["stands"] = tuple(found["stands"])
    try:
        info = RunInfo(**found)
    except TypeError as error:
        raise ValueError(str(error)) from None
    _refuse_nonsense(info)
    return info


def _refuse_nonsense(info: RunInfo) -> None:
    """Refuse what no run is started with; files are made with these numbers and names."""
    texts = (
        info.rig,
        info.profile,
        info.config_yaml,
        info.walk_yaml,
        info.gestures_yaml,
        info.eyes,
        info.bus,
    )
    maybe = (info.character, info.scene)
    if not all(isinstance(word, str) for word in texts + tuple(m for m in maybe if m is not None)):
        raise ValueError("a name of the run is no text")
    if not (_within(info.rate_hz, 1.0, 10_000.0) and _within(info.pictures_hz, 0.0, 1000.0)):
        raise ValueError(f"a control rate of {info.rate_hz} Hz")
    if type(info.seed) is not int or info.seed < 0:
        raise ValueError(f"the seed {info.seed}")
    if type(info.mock) is not bool or type(info.fast) is not bool:
        raise ValueError("neither real nor emulated")
    if not isinstance(info.versions, dict):
        raise ValueError("no versions")
    if not _is_place(info.stands):
        raise ValueError("a place that is none")
    started_ns(info)


def _is_place(stands: object) -> bool:
    """Return whether these are the numbers of ``RunInfo.stands``."""
    if not isinstance(stands, tuple) or len(stands) not in (0, 12):
        return False
    return all(_within(number, -1000.0, 1000.0) for number in stands)


def _within(value: object, low: float, high: float) -> bool:
    return type(value) in (int, float) and low <= value <= high  # type: ignore[operator]


def end_of(text: Mapping[str, str]) -> RunEnd:
    """Read what ``as_text`` gave of a run's end.

    Raises:
        ValueError: something is no JSON.
    """
    end = RunEnd(**_read(text, {f.name for f in fields(RunEnd)}))
    if not isinstance(end.stopped_by, str) or not isinstance(end.tx_sha256, str):
        raise ValueError("an end that is no text")
    if type(end.lost) is not int or not (end.ran_s is None or _within(end.ran_s, 0.0, 1e9)):
        raise ValueError("an end that is no number")
    return end


def _read(text: Mapping[str, str], names: set[str]) -> dict[str, Any]:
    """Read the fields that this version knows."""
    known = {key: value for key, value in text.items() if key in names}
    return {k: v if k.endswith("_yaml") else json.loads(v) for k, v in known.items()}
