"""Motion laid over gaze: what gestures, expressions and levels add to the pose of the head.

Gaze goes on beneath: what is added to the head's angles is compensated by the eyes, which stay
on their target (the vestibulo-ocular reflex of ``gazerig.gaze.oculomotor.oculomotor``).
"""

from collections.abc import Mapping
from typing import NamedTuple

from gazerig.gaze.gesture.expression import Expressions
from gazerig.gaze.gesture.gesture_player import GesturePlayer
from gazerig.gaze.gesture.level import LevelRange, Levels
from gazerig.gaze.gesture.pose_offset import NO_OFFSET as NO_OFFSET
from gazerig.gaze.gesture.pose_offset import PoseOffset as PoseOffset


class AnimationTables(NamedTuple):
    """What a rig's tables come to.

    expressions: what each adds at full strength; blend_s: time from one to another
    """

    expressions: Mapping[str, PoseOffset]
    blend_s: float
    levels: Mapping[str, LevelRange]


NO_TABLES = AnimationTables({}, 0.5, {})


class Animation:
    """Everything that moves beside gaze, as one offset a tick.

    expressions, levels, gestures: take what is asked for
    """

    def __init__(self, joints: tuple[str, ...] = (), tables: AnimationTables = NO_TABLES) -> None:
        """Begin at rest.

        Args:
            joints: the joints that gaze does not move (``gazerig.robot.model.types.further``).
            tables: expressions and levels.
        """
        self.expressions = Expressions(tables.expressions, tables.blend_s, len(joints))
        self.levels = Levels(tables.levels, len(joints))
        self.gestures = GesturePlayer(len(joints))
        self._sum = NO_OFFSET

    def reset(self, t_s: float) -> None:
        """Begin at rest at a time."""
        self.expressions.reset()
        self.levels.reset()
        self.gestures.reset()

    def retune(self, tables: AnimationTables) -> None:
        """Change the tables; what moves goes on without a jump."""
        self.expressions.retune(tables.expressions, tables.blend_s)
        self.levels.retune(tables.levels)

    def step(self, t_s: float) -> PoseOffset:
        """Return what is added to the pose in this tick."""
        expressions, levels, gestures = self.expressions, self.levels, self.gestures
        if expressions.moves or levels.moves or gestures.moves:
            face = expressions.step(t_s).plus(levels.step(t_s))
            self._sum = face.plus(gestures.step(t_s))
        return self._sum
