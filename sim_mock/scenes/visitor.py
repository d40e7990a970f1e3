"""The scene ``visitor``: a person who arrives, talks, moves, waves, leaves and returns."""

from math import pi, sin

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing, between

# One round: arrive, talk, move left, turn the head, wave, step aside, leave, return.
_ROUND_S = 44.0
_KEYS = (
    Key(0.0, (1.0, -0.05, 0.24), (0.0, 0.0)),
    Key(5.0, (1.0, -0.05, 0.24), (0.0, 0.0)),
    Key(6.5, (0.85, 0.30, 0.27), (0.0, 0.0)),
    Key(10.0, (0.85, 0.30, 0.27), (0.0, 0.0)),
    Key(11.0, (0.85, 0.30, 0.27), (28.0, 0.0)),
    Key(13.0, (0.85, 0.30, 0.27), (-22.0, -8.0)),
    Key(14.0, (0.85, 0.30, 0.27), (0.0, 0.0)),
    Key(16.0, (0.80, 0.02, 0.25), (0.0, 0.0)),
    Key(23.0, (0.80, 0.02, 0.25), (0.0, 5.0)),
    Key(24.5, (0.90, -0.55, 0.22), (0.0, 0.0)),
    Key(29.0, (0.90, -0.55, 0.22), (0.0, 0.0)),
    Key(32.0, (-1.50, -2.60, 0.22), (-40.0, 0.0)),
    Key(37.0, (-1.50, -2.60, 0.22), (-40.0, 0.0)),
    Key(40.0, (1.0, -0.05, 0.24), (0.0, 0.0)),
    Key(_ROUND_S, (1.0, -0.05, 0.24), (0.0, 0.0)),
)
_WAVE_S = (17.5, 21.0)


class Visitor:
    """The scene ``visitor``."""

    name = "visitor"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one visitor, who may be far outside every field of view."""
        phase = t_s % _ROUND_S
        face, turn = between(_KEYS, phase)
        sway = (
            0.006 * sin(2 * pi * 0.23 * t_s),
            0.010 * sin(2 * pi * 0.17 * t_s + 1.0),
            0.004 * sin(2 * pi * 0.31 * t_s + 2.0),
        )
        face = (face[0] + sway[0], face[1] + sway[1], face[2] + sway[2])
        return (ScenePerson(face, turn, self._hand(phase, face)),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return nothing: the visitor's own hand belongs to the visitor."""
        return ()

    def events(self) -> tuple[Event, ...]:
        """Return none: no particular gaze is expected."""
        return ()

    def _hand(self, phase_s: float, face: Vec3) -> Vec3 | None:
        """Return the hand that waves 1.5 times a second next to the head and rises smoothly."""
        start, end = _WAVE_S
        if not start <= phase_s <= end:
            return None
        raised = min(1.0, (phase_s - start) / 0.5, (end - phase_s) / 0.5)
        swing = 0.12 * sin(2 * pi * 1.5 * (phase_s - start)) * raised
        return (face[0] - 0.12, face[1] - 0.26 + swing, face[2] - 0.30 + 0.28 * raised)
