"""A small schema of a configuration, and files of it."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest

from gazerig.config.load import ConfigError, load
from gazerig.params import Bounds, Choices, Unit


@dataclass(frozen=True, slots=True)
class Joint:
    id: Annotated[int, Bounds(0, 252), "servo id"]
    max_speed_deg_s: Annotated[float, Bounds(1, 2000)] = 300.0
    low_deg: float = -30.0
    high_deg: float = 30.0

    def __post_init__(self) -> None:
        if self.low_deg >= self.high_deg:
            raise ValueError("low_deg must be\nbelow high_deg")


@dataclass(frozen=True, slots=True)
class Camera:
    fps: Annotated[int, Bounds(1, 120), Unit("Hz")] = 30
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    face: bool = True


@dataclass(frozen=True, slots=True)
class Rig:
    name: str
    joints: Mapping[str, Joint]
    camera: Camera = Camera()
    spare: Camera | None = None
    dwell: Literal["gamma", "lognormal"] = "gamma"
    gains: Annotated[dict[str, float], Bounds(0, 1e308)] = field(default_factory=dict)
    matrix: tuple[tuple[float, ...], ...] = ()
    baud: int = 57_600
    line: Annotated[Literal[57_600, 1_000_000], "speed of the line"] = 57_600
    kind: Annotated[str, Choices("flat", "round")] = "flat"
    pair: Annotated[tuple[int, int], Bounds(-9, 9)] = (1, 2)
    tags: tuple[str, ...] = ()


def one_id_each(rig: Rig) -> Iterator[tuple[str, str]]:
    owners: dict[int, str] = {}
    for name, joint in rig.joints.items():
        if joint.id in owners:
            yield f"joints.{name}.id", f"id {joint.id} is also that of {owners[joint.id]}"
        owners.setdefault(joint.id, name)


def faults_of(folder: Path, text: str | bytes, checks: Sequence[Any] = ()) -> list[str]:
    """Load a rig that is at fault and give its message without the folder."""
    with pytest.raises(ConfigError) as caught:
        load(write(folder, text), Rig, checks=checks)
    assert not [fault for fault in caught.value.faults if "\n" in fault.rule]
    return str(caught.value).replace(f"{folder}{os.sep}", "").splitlines()


def write(folder: Path, text: str | bytes, name: str = "rig.yaml") -> Path:
    file = folder / name
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return file
