"""The scene ``face-to-face``: a person at several heights who walks about before the robot.

Nakamoto & Tsuruno 4.2: the character must keep looking at a user who is higher or lower than
itself and never at rest. One person sits, stands up, walks about, and bends down to the height of
a child; always between 0.6 and 1.5 m from the robot's eyes, at most at the speed of a stroll, and
always visible to the robot. The face is turned to the robot except for glances aside: people look
at a speaker for about 75 % of the time (Argyle and Cook), otherwise away by about 14 deg and
mostly sideways. Not modelled: a child's smaller face.
"""

from math import atan2, hypot, pi, sin

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing, between

HEAD_M: Vec3 = (0.04, 0.0, 0.13)

_ROUND_S = 60.0
_KEYS = (
    # Sitting, and sitting nearer.
    Key(0.0, (0.95, 0.0, 0.22)),
    Key(3.3, (0.95, 0.0, 0.22)),
    Key(3.9, (0.95, 0.0, 0.22), (15.0, 0.0)),
    Key(4.8, (0.95, 0.0, 0.22), (15.0, 0.0)),
    Key(5.4, (0.95, 0.0, 0.22)),
    Key(8.0, (0.80, 0.05, 0.22)),
    Key(11.0, (0.80, 0.05, 0.22)),
    Key(11.6, (0.80, 0.05, 0.22), (-14.0, 4.0)),
    Key(12.6, (0.80, 0.05, 0.22), (-14.0, 4.0)),
    Key(13.2, (0.80, 0.05, 0.22)),
    Key(16.5, (0.80, 0.05, 0.22)),
    # Standing up, a step back, walking to both sides.
    Key(18.5, (1.25, 0.10, 0.62)),
    Key(22.0, (1.25, 0.10, 0.62)),
    Key(24.0, (1.15, 0.50, 0.62)),
    Key(26.5, (1.15, 0.50, 0.62)),
    Key(27.2, (1.15, 0.50, 0.62), (-16.0, 0.0)),
    Key(28.2, (1.15, 0.50, 0.62), (-16.0, 0.0)),
    Key(32.0, (1.20, -0.45, 0.60)),
    Key(35.0, (1.20, -0.45, 0.60)),
    Key(35.6, (1.20, -0.45, 0.60), (14.0, 6.0)),
    Key(36.4, (1.20, -0.45, 0.60), (14.0, 6.0)),
    Key(37.0, (1.20, -0.45, 0.60)),
    # At the height of a child, near, and walking about.
    Key(42.5, (0.80, -0.15, 0.00)),
    Key(45.0, (0.80, -0.15, 0.00)),
    Key(47.0, (0.72, 0.20, -0.02)),
    Key(49.0, (0.72, 0.20, -0.02)),
    Key(49.6, (0.72, 0.20, -0.02), (14.0, 0.0)),
    Key(50.6, (0.72, 0.20, -0.02), (14.0, 0.0)),
    Key(51.2, (0.72, 0.20, -0.02)),
    Key(54.0, (0.72, 0.20, -0.02)),
    # Sitting down again.
    Key(57.0, (0.95, 0.0, 0.22)),
    Key(_ROUND_S, (0.95, 0.0, 0.22)),
)


class FaceToFace:
    """The scene ``face-to-face``."""

    name = "face-to-face"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person."""
        (x, y, z), (yaw, nod) = between(_KEYS, t_s % _ROUND_S)
        face = (
            x + 0.006 * sin(2 * pi * 0.21 * t_s),
            y + 0.012 * sin(2 * pi * 0.17 * t_s + 1.0),
            z + 0.004 * sin(2 * pi * 0.29 * t_s + 2.0),
        )
        to_head = (HEAD_M[0] - face[0], HEAD_M[1] - face[1], HEAD_M[2] - face[2])
        down = atan2(to_head[2], hypot(to_head[0], to_head[1]))
        return (ScenePerson(face, (yaw, nod + down), None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return nothing: person and robot are alone."""
        return ()

    def events(self) -> tuple[Event, ...]:
        """Expect the gaze on the face, all the time."""
        return (Event("face", "look", "face", 0.0, _ROUND_S, (1.0, 0.0, 0.3), 1.0),)
