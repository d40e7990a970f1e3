"""Interface of a simulated scene: people, things, expected gaze.

Everything is a closed form of the time, so a scene needs no stepping and does not depend on how
often it is read. World frame (x forward, y left, z up), metres, seconds from the start of the
scene. Not modelled: bodies below the neck, gait, facial expression.
"""

from typing import Literal, NamedTuple, Protocol

from gazerig.gaze.types import Angles2, Vec3


class ScenePerson(NamedTuple):
    """One person at one instant.

    p_world_face_m: tip of the nose
    face_yaw_pitch_rad: direction of the face, yaw 0 = along the world's +x
    hand: position of a raised hand, None while it is not raised
    speaks: whether the lips move as in speech
    """

    p_world_face_m: Vec3
    face_yaw_pitch_rad: Angles2
    hand: Vec3 | None
    speaks: bool = False


class Thing(NamedTuple):
    """One thing at one instant.

    id:   constant over the scene
    kind: "hand", "thing", ...
    spin_rad_s: rotation about the line of sight, clockwise as the robot sees it if positive
    turned_rad: angle of this rotation
    person: number of the person whose hand it is, None for other things
    """

    id: int
    kind: str
    p_world_m: Vec3
    radius_m: float
    spin_rad_s: float = 0.0
    turned_rad: float = 0.0
    person: int | None = None


class Event(NamedTuple):
    """An event in a round, and the gaze that a person would show.

    response: "look": be on the target between start and end; "return": be on it again by the end
    kind: kind of the target, within ``within_m`` of ``place_world_m``
    start_s, end_s: times from the start of the round
    due_s: arrival of a punch; None for all other events
    """

    name: str
    response: Literal["look", "return"]
    kind: str
    start_s: float
    end_s: float
    place_world_m: Vec3
    within_m: float
    due_s: float | None = None


class Scene(Protocol):
    """The people and things at an instant; it repeats after every round.

    behaviours: behaviours from which the robot's action planner must choose, so that a rig without
        a rule for one can be rejected before it moves; empty if nothing is planned
    """

    name: str
    round_s: float
    behaviours: tuple[str, ...]

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return all people present, including those outside every field of view."""
        ...

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return all other possible gaze targets."""
        ...

    def events(self) -> tuple[Event, ...]:
        """Return the events of one round; each ends within the round."""
        ...


def min_jerk(s: float) -> float:
    """Return the minimum-jerk path from 0 to 1 at a share 0..1 of its time."""
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


def there_and_back(since_s: float, out_s: float, hold_s: float, back_s: float) -> float:
    """Return a smooth rise from 0 to 1 in ``out_s``, a hold, and a smooth return to 0."""
    if since_s <= 0.0 or since_s >= out_s + hold_s + back_s:
        return 0.0
    if since_s < out_s:
        return min_jerk(since_s / out_s)
    return min_jerk(min(1.0, (out_s + hold_s + back_s - since_s) / back_s))
