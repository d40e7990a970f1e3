"""Interface of a simulated scene: people, things, expected gaze.

Everything is a closed form of the time, so a scene needs no stepper and looks the same
however often it is looked at. World frame (x forward, y left, z up), metres, seconds
from the scene's beginning. Not modelled: bodies below the neck, gait, facial expression.
"""

from collections.abc import Sequence
from math import atan2, radians
from typing import Literal, NamedTuple, Protocol

from gazerig.gaze.types import Angles2, Vec3


class ScenePerson(NamedTuple):
    """One person at one instant.

    p_world_face_m: tip of the nose
    face_yaw_pitch_rad: where the face points, yaw 0 = along the world's +x
    hand: place of a raised hand, None while it hangs out of sight
    """

    p_world_face_m: Vec3
    face_yaw_pitch_rad: Angles2
    hand: Vec3 | None


class Thing(NamedTuple):
    """One thing at one instant.

    id:   the same for as long as the scene lasts
    kind: "hand", "thing", ...
    spin_rad_s: rotation about the line of sight, clockwise as the robot sees it above 0
    turned_rad: how far it has turned so
    person: number of the person whose hand it is, None where it is nobody's
    """

    id: int
    kind: str
    p_world_m: Vec3
    radius_m: float
    spin_rad_s: float = 0.0
    turned_rad: float = 0.0
    person: int | None = None


class Event(NamedTuple):
    """Something that happens in a round, and what a gaze like a person's does about it.

    asks: "look": be on it between start and end; "return": be on it again by the end
    kind: what must be looked at, within ``within_m`` of ``place_world_m``
    start_s, end_s: from the beginning of the round
    due_s: when a punch arrives; None for everything else
    """

    name: str
    asks: Literal["look", "return"]
    kind: str
    start_s: float
    end_s: float
    place_world_m: Vec3
    within_m: float
    due_s: float | None = None


class Scene(Protocol):
    """The people and things at an instant; it repeats after every round.

    behaviours: those between which the robot's action planner has to choose there, so that a rig
        without a rule for one can be refused before it moves; none where it plans nothing
    """

    name: str
    round_s: float
    behaviours: tuple[str, ...]

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return all people present, also those outside every field of view."""
        ...

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return everything else that can be looked at."""
        ...

    def events(self) -> tuple[Event, ...]:
        """Return the events of one round, none of which outlasts the round."""
        ...


class Key(NamedTuple):
    """Where a person is from ``t_s`` on: face, and the turn of the face off the robot."""

    t_s: float
    face: Vec3
    turn_deg: Angles2 = (0.0, 0.0)


def min_jerk(s: float) -> float:
    """Return a minimum-jerk path from 0 to 1 at a share 0..1 of its time."""
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


def there_and_back(since_s: float, out_s: float, hold_s: float, back_s: float) -> float:
    """Return 0 before, smoothly up to 1 in ``out_s``, held, and smoothly down to 0 again."""
    if since_s <= 0.0 or since_s >= out_s + hold_s + back_s:
        return 0.0
    if since_s < out_s:
        return min_jerk(since_s / out_s)
    return min_jerk(min(1.0, (out_s + hold_s + back_s - since_s) / back_s))


def between(keys: Sequence[Key], phase_s: float) -> tuple[Vec3, Angles2]:
    """Move from key to key with minimum jerk; the face looks at the robot plus its turn.

    Returns the place of the face and its (yaw, pitch); the pitch is the turn's alone.
    """
    last = keys[0]
    for following in keys[1:]:
        if phase_s < following.t_s:
            break
        last = following
    else:
        following = last
    span = following.t_s - last.t_s
    f = min_jerk((phase_s - last.t_s) / span if span > 0.0 else 0.0)
    x, y, z = (a + f * (b - a) for a, b in zip(last.face, following.face, strict=True))
    turn, nod = (
        radians(a + f * (b - a)) for a, b in zip(last.turn_deg, following.turn_deg, strict=True)
    )
    return (x, y, z), (atan2(-y, -x) + turn, nod)
