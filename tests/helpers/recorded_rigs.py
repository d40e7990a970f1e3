"""Simulated runs of a rig, recorded, with their ticks."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from fakes.runs import VISIT, record

from gazerig.config.schema import Rig
from gazerig.robot.loop.loop import Tick
from gazerig.robot.recording.read import RunRecording


class RecordedRun(NamedTuple):
    recording: RunRecording
    ticks: list[Tick]


def recorded(path: Path, rig: Rig, seconds: float) -> RecordedRun:
    """Record a simulated run; give its ticks too."""
    seen = record(path, rig, seconds, replace(VISIT, rig="a rig", bus="emulated"))
    return RecordedRun(RunRecording(path), seen)
