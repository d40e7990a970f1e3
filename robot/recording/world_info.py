"""Metadata of a recorded run's simulated world; stored in the recording as text."""

import json
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WorldInfo:
    """A simulated world of a run.

    Attributes:
        name: Name of its script or file, without folder and suffix.
        script_yaml: The complete script, "" for a world in MuJoCo's own format.
        seed: Seed of its people's behaviour.
        start_s: Start of their script on the clock of the ticks.
    """

    name: str
    script_yaml: str = ""
    seed: int = 0
    start_s: float = 0.0


def read_world_info(text: Mapping[str, str]) -> WorldInfo:
    """Read a world that ``gazerig.robot.recording.run_info.as_text`` wrote.

    Raises:
        ValueError: A field is missing, is not JSON or has an impossible value.
    """
    try:
        name, seed, start_s = (json.loads(text[key]) for key in ("name", "seed", "start_s"))
        script_yaml = text["script_yaml"]
    except KeyError as error:
        raise ValueError(f"a world without {error}") from None
    if not isinstance(name, str) or type(seed) is not int or seed < 0:
        raise ValueError(f"the world {name!r}, seed {seed!r}")
    if type(start_s) not in (int, float) or not -1e9 < start_s < 1e9:
        raise ValueError(f"a world that began at {start_s!r}")
    return WorldInfo(name, script_yaml, seed, float(start_s))
