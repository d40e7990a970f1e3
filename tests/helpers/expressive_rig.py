"""The desk rig with a jaw and two brows, expressions and a level, for tests."""

from dataclasses import replace

from fakes.runs import simulated

from gazerig.config.rig import Rig
from gazerig.config.schema import RULES, load_rig
from gazerig.gaze.track.animation import LevelParams
from gazerig.robot.run.run import Run


def expressive_rig() -> Rig:
    """Return a rig whose last joints are left_brow and right_brow and, between them, jaw."""
    rig = load_rig("desk")
    jaw = replace(rig.joints["left_upper_lid"], id=40, min_deg=-2.0, max_deg=25.0)
    brow = replace(jaw, min_deg=-20.0, max_deg=20.0)
    more = {"jaw": jaw, "left_brow": replace(brow, id=41), "right_brow": replace(brow, id=42)}
    return replace(
        rig,
        joints={**rig.joints, **more},
        expressions={
            "happy": {"jaw": 6.0, "left_brow": 8.0, "right_brow": 8.0, "neck_roll": 4.0},
            "sad": {"left_brow": -12.0, "right_brow": -12.0, "left_upper_lid": -15.0},
            "surprised": {"jaw": 14.0, "left_brow": 18.0, "right_brow": 18.0},
        },
        levels={"mouth": LevelParams("jaw", 0.0, 10.0, 80.0)},
    )


def faults(rig: Rig) -> list[str]:
    """Return the rules between sections that a rig breaks."""
    return [f"{key}: {text}" for rule in RULES for key, text in rule(rig)]


def started(rig: Rig | None = None) -> Run:
    """Return a robot of the rig that has begun, in simulated time; close it."""
    made = simulated(rig or expressive_rig())
    made.robot.start(made.clock)
    return made
