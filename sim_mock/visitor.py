"""A simulated visitor: a person who comes, talks, moves, waves, leaves and comes back.

Everything is a closed form of the time, so a scene needs no stepper and looks the same
however often it is looked at. World frame (x forward, y left, z up), metres, seconds.
Not modelled: a body below the neck, walking gait, facial expression.
"""

from math import atan2, pi, radians, sin
from typing import NamedTuple, Protocol

from gaze.types import Angles2, Vec3


class Person(NamedTuple):
    """One person at one instant.

    p_world_face_m: tip of the nose
    face_yaw_pitch_rad: where the face points, yaw 0 = along the world's +x
    hand: place of a raised hand, None while it hangs out of sight
    """

    p_world_face_m: Vec3
    face_yaw_pitch_rad: Angles2
    hand: Vec3 | None


class Scene(Protocol):
    """Who is there at an instant."""

    name: str

    def people(self, t_s: float) -> tuple[Person, ...]:
        """Give everybody present."""
        ...


class _Key(NamedTuple):
    """Where the person is from ``t_s`` on: face, and the turn of the face off the robot."""

    t_s: float
    face: Vec3
    turn_deg: Angles2


# One round: arrive, talk, move left, turn the head, wave, step aside, leave, come back.
_ROUND_S = 44.0
_KEYS = (
    _Key(0.0, (1.0, -0.05, 0.24), (0.0, 0.0)),
    _Key(5.0, (1.0, -0.05, 0.24), (0.0, 0.0)),
    _Key(6.5, (0.85, 0.30, 0.27), (0.0, 0.0)),
    _Key(10.0, (0.85, 0.30, 0.27), (0.0, 0.0)),
    _Key(11.0, (0.85, 0.30, 0.27), (28.0, 0.0)),
    _Key(13.0, (0.85, 0.30, 0.27), (-22.0, -8.0)),
    _Key(14.0, (0.85, 0.30, 0.27), (0.0, 0.0)),
    _Key(16.0, (0.80, 0.02, 0.25), (0.0, 0.0)),
    _Key(23.0, (0.80, 0.02, 0.25), (0.0, 5.0)),
    _Key(24.5, (0.90, -0.55, 0.22), (0.0, 0.0)),
    _Key(29.0, (0.90, -0.55, 0.22), (0.0, 0.0)),
    _Key(31.0, (0.70, -3.20, 0.22), (-40.0, 0.0)),
    _Key(37.0, (0.70, -3.20, 0.22), (-40.0, 0.0)),
    _Key(40.0, (1.0, -0.05, 0.24), (0.0, 0.0)),
    _Key(_ROUND_S, (1.0, -0.05, 0.24), (0.0, 0.0)),
)
_WAVE_S = (17.5, 21.0)


class Visitor:
    """The scene ``visitor``."""

    name = "visitor"

    def people(self, t_s: float) -> tuple[Person, ...]:
        """Give the one visitor, who may be far outside every field of view."""
        phase = t_s % _ROUND_S
        face, turn = _between_keys(phase)
        sway = (
            0.006 * sin(2 * pi * 0.23 * t_s),
            0.010 * sin(2 * pi * 0.17 * t_s + 1.0),
            0.004 * sin(2 * pi * 0.31 * t_s + 2.0),
        )
        face = (face[0] + sway[0], face[1] + sway[1], face[2] + sway[2])
        return (Person(face, turn, self._hand(phase, face)),)

    def _hand(self, phase_s: float, face: Vec3) -> Vec3 | None:
        """Wave: 1.5 times a second beside the head, rising and sinking smoothly."""
        start, end = _WAVE_S
        if not start <= phase_s <= end:
            return None
        raised = min(1.0, (phase_s - start) / 0.5, (end - phase_s) / 0.5)
        swing = 0.12 * sin(2 * pi * 1.5 * (phase_s - start)) * raised
        return (face[0] - 0.12, face[1] - 0.26 + swing, face[2] - 0.30 + 0.28 * raised)


def _between_keys(phase_s: float) -> tuple[Vec3, Angles2]:
    """Move from key to key with minimum jerk; the face looks at the robot plus its turn."""
    last = _KEYS[0]
    for following in _KEYS[1:]:
        if phase_s < following.t_s:
            break
        last = following
    else:
        following = last
    span = following.t_s - last.t_s
    s = (phase_s - last.t_s) / span if span > 0.0 else 0.0
    f = s * s * s * (10.0 + s * (6.0 * s - 15.0))
    x, y, z = (a + f * (b - a) for a, b in zip(last.face, following.face, strict=True))
    turn, nod = (
        radians(a + f * (b - a)) for a, b in zip(last.turn_deg, following.turn_deg, strict=True)
    )
    return (x, y, z), (atan2(-y, -x) + turn, nod)


def scenes() -> dict[str, Scene]:
    """Give the scenes by name."""
    return {Visitor.name: Visitor()}
