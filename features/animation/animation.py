"""Animation files of other programs as joint angles over time."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import msgspec
import numpy as np

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.gaze.track.track import MAX_DURATION_S
from gazerig.gaze.types import Floats

Series = tuple[Floats, Floats]
"""Times in seconds and angles in degrees of one joint."""
MOST_KEYS = 5_000_000
"""Keys of one file: twelve joints, 30 frames a second, for four hours."""
_MOST_NAMES = 20
SAMPLE_S = 0.02
"""Interval of the samples of a curve with handles."""
LARGEST = 200_000_000

T = TypeVar("T")


class ImportedAnimation(NamedTuple):
    """An animation on one rig.

    series: times and angles by joint
    notes: parts of the file that were left out or changed
    poses: whether its angles are meant as poses; those of tables are motions
    """

    series: dict[str, Series]
    notes: tuple[str, ...] = ()
    poses: bool = True


@dataclass
class JointMap:
    """Joints of a rig by the names in a file.

    joints: joints of the rig
    given: joints by the names of the file, where they differ; a joint with "-" before it turns the
        other direction
    """

    joints: Sequence[str]
    given: Mapping[str, str] = field(default_factory=dict)

    def find(self, name: str) -> tuple[str, int] | None:
        """Return the joint of a name and the sign of its angles; None if it is no joint."""
        wanted = self.given.get(name, name)
        joint, sign = wanted.removeprefix("-"), -1 if wanted.startswith("-") else 1
        return (joint, sign) if joint in self.joints else None

    def require(self, what: str, name: str) -> tuple[str, int]:
        """Return the joint of a name and the sign of its angles.

        Raises:
            SetupError: it is no joint; ``what`` states the file and what has the name.
        """
        found = self.find(name)
        if found is None:
            raise SetupError(f"{what}{name!r} is no joint: {self.hint()}")
        return found

    def hint(self) -> str:
        """Return the remedy for an unknown name."""
        return f"rename it or add --map NAME=JOINT; joints of the rig: {', '.join(self.joints)}"


def joint_map(rig: Rig, given: Sequence[str]) -> JointMap:
    """Return the map of a rig's joints from words like ``3=neck_yaw`` or ``tilt=-neck_pitch``.

    Raises:
        SetupError: a word has another form, or the rig lacks a joint.
    """
    found = {}
    for word in given:
        name, equal, joint = word.partition("=")
        if not equal or joint.removeprefix("-") not in rig.names:
            raise SetupError(
                f"--map {word}: give NAME=JOINT or NAME=-JOINT; joints of {rig.name}: "
                f"{', '.join(rig.names)}"
            )
        found[name] = joint
    return JointMap(rig.names, found)


def decode(path: Path, data: bytes, kind: type[T], what: str) -> T:
    """Return JSON as a checked value.

    Args:
        path: path of the file, for messages.
        data: the JSON text.
        kind: its structure.
        what: name of the format.

    Raises:
        SetupError: it is not JSON, or has another structure; with the place.
    """
    try:
        return msgspec.json.decode(data, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise SetupError(
            f"{path}: {error}: it is truncated or not {what}; export it again"
        ) from None


def check_keys(where: str, times_s: Floats, values: np.ndarray[Any, Any]) -> None:
    """Refuse keys that are not numbers or not in the order of their times.

    Args:
        where: file and joint, for the message.
        times_s: (n,) times.
        values: (n, ...) values.

    Raises:
        SetupError: names the first such key.
    """
    if not len(times_s):
        raise SetupError(f"{where}: no keys: export it again")
    finite = np.isfinite(times_s) & np.isfinite(values.reshape(len(times_s), -1)).all(axis=1)
    if not finite.all():
        raise SetupError(f"{where}: key {int(finite.argmin())} is not a number: export it again")
    if times_s[-1] > MAX_DURATION_S:
        raise SetupError(
            f"{where}: it takes {times_s[-1]:g} s; at most {MAX_DURATION_S:g} s are read: split it"
        )
    steps = np.diff(times_s)
    if times_s[0] < 0.0:
        raise SetupError(f"{where}: key 0 is at {times_s[0]:g} s, before 0: begin at frame 0")
    if (steps <= 0.0).any():
        i = int((steps <= 0.0).argmax())
        raise SetupError(
            f"{where}: key {i + 1} at {times_s[i + 1]:g} s is not after {times_s[i]:g} s: "
            "export it again"
        )


def check_count(where: str, count: int, what: str = "keys") -> None:
    """Refuse more keys than a track can be made of.

    Raises:
        SetupError: states the number and the remedy.
    """
    if count > MOST_KEYS:
        raise SetupError(
            f"{where}: {count:,} {what}; at most {MOST_KEYS:,} are read: export fewer frames a "
            "second, or in parts"
        )


def listed(names: Collection[str]) -> str:
    """Return names as text, a long list shortened."""
    shown = ", ".join(f"{name:.80}" for name in islice(names, _MOST_NAMES))
    return shown + ", ..." * (len(names) > _MOST_NAMES)
