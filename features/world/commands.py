"""Commands to a world as lines of text: ``push head 5 left 0.5``."""

from math import cos, sin

from gazerig.features.world.physics import World
from gazerig.sim_mock.faults.grammar import (
    Argument,
    CommandTable,
    Verb,
    anything,
    number,
    one_of,
)

DIRECTIONS = {
    "forward": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}
"""In the frame of the rig's base: its own left."""

PUSH_S = 0.5
"""Default duration of a push."""

MOST_N = 100.0
"""A larger force breaks a head."""


def _push(world: World, body: str, newton: float, to: str, seconds: float = PUSH_S) -> str:
    """Push a body of a rig; that of a further rig is named with its prefix."""
    rig = next((nth for nth in range(len(world.model.rigs)) if world.has_body(body, nth)), 0)
    placed = world.model.rigs[rig].rig
    x, y, z = DIRECTIONS[to]
    c, s = cos(placed.yaw_rad), sin(placed.yaw_rad)
    force = newton * (c * x - s * y), newton * (s * x + c * y), newton * z
    world.push(body, force, seconds, rig)
    return f"{body} is pushed {to} with {newton:g} N for {seconds:g} s"


COMMANDS = CommandTable(
    {
        "push": Verb(
            _push,
            (
                Argument("BODY", anything),
                Argument("N", number(0.0, MOST_N, "newtons")),
                Argument("|".join(DIRECTIONS), one_of(*DIRECTIONS)),
                Argument("SECONDS", number(0.001, 60.0, "seconds"), optional=True),
            ),
            "push a part of the head, such as head, at its origin; the servos give way",
        ),
    },
    {},
    "a body of the rig",
)
"""Fault commands of a world."""
