"""Gestures by name: shipped ones, and those of a rig's own files; all are checked."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

from gazerig.config.load import (
    ConfigError,
    ConfigFault,
    load,
    package_file_path,
    shipped_names,
    shipped_path,
)
from gazerig.gaze.gesture.gesture import Gesture, frame_faults, loop_fault
from gazerig.robot.model.types import GAZE_JOINTS, JOINT_NAME

_HEAD_KEYS = {
    "neck_yaw": "head_yaw_deg",
    "neck_pitch": "head_pitch_deg",
    "neck_roll": "head_roll_deg",
}


def load_gesture(path: Path) -> Gesture:
    """Return the gesture of a file.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    return load(path, Gesture, checks=CHECKS)


def shipped_gestures() -> Mapping[str, Gesture]:
    """Return the gestures of this package by name."""
    return _shipped()


@cache
def _shipped() -> Mapping[str, Gesture]:
    return {
        name: load_gesture(shipped_path("gestures", name)) for name in shipped_names("gestures")
    }


def gestures_of(files: Sequence[str]) -> dict[str, Gesture]:
    """Return the gestures of a rig: shipped ones, and its own by the names of their files.

    Args:
        files: Paths of its own gestures; they replace shipped gestures of the same name.

    Raises:
        gazerig.config.load.ConfigError: lists every fault of all files.
    """
    found = dict(shipped_gestures())
    faults: list[ConfigFault] = []
    for file in files:
        try:
            found[gesture_name(file)] = load_gesture(gesture_path(file))
        except ConfigError as error:
            faults += error.faults
    if faults:
        raise ConfigError(faults)
    return found


@dataclass(frozen=True)
class GestureSet:
    """Gestures as stored in a recording."""

    gestures: Annotated[Mapping[str, Gesture], "gestures of the rig by name"]


def gesture_path(file: str) -> Path:
    """Return the path of a gesture file; a name alone selects a gesture of a package.

    Raises:
        gazerig.config.load.ConfigError: no package has a gesture of this name.
    """
    if "/" in file or file.endswith((".yaml", ".yml")):
        return Path(file).expanduser()
    return package_file_path("gestures", file)


def gesture_name(file: str) -> str:
    """Return the name of a gesture in a file.

    Raises:
        gazerig.config.load.ConfigError: it is not a valid name.
    """
    name = Path(file).stem
    if JOINT_NAME.fullmatch(name):
        return name
    rule = "the file name is the gesture's name: lower-case letters, digits and _, beginning with a letter, at most 40 characters"
    raise ConfigError([ConfigFault(file, None, "", repr(name), rule)])


def _frame_times(gesture: Gesture) -> Iterable[tuple[str, str]]:
    for key in ("frames", "frames_without_neck"):
        for i, rule in frame_faults(getattr(gesture, key)):
            yield f"{key}.{i}.time_s", rule
    if rule := loop_fault(gesture):
        yield "loop_s", rule


def _joint_names(gesture: Gesture) -> Iterable[tuple[str, str]]:
    for key in ("frames", "frames_without_neck"):
        for i, frame in enumerate(getattr(gesture, key)):
            for joint in frame.joints_deg:
                if joint in GAZE_JOINTS:
                    instead = _HEAD_KEYS.get(joint, "lids" if joint.endswith("lid") else "eyes_yaw_deg and eyes_pitch_deg")  # fmt: skip
                    yield f"{key}.{i}.joints_deg.{joint}", f"is moved by {instead}; use that"
                elif not JOINT_NAME.fullmatch(joint):
                    yield f"{key}.{i}.joints_deg.{joint}", "not the name of a joint"


CHECKS = (_frame_times, _joint_names)
"""Rules across frames."""
