"""The simulated world that a recorded run was in; kept in the recording as text."""

import json
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WorldInfo:
    """A world as a run was in it.

    name: of its script or file, without folder and ending
    script_yaml: everything its script says, "" of one in MuJoCo's own format
    seed: of what its people do
    start_s: when their script began, on the clock of the ticks
    """

    name: str
    script_yaml: str = ""
    seed: int = 0
    start_s: float = 0.0


def world_of(text: Mapping[str, str]) -> WorldInfo:
    """Read what ``gazerig.robot.recording.run_info.as_text`` gave of a world.

    Raises:
        ValueError: something is missing, no JSON or nonsense.
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
