"""Motion added to gaze: tracks, expressions and levels as offsets of the head's pose.

Gaze continues: the eyes compensate offsets of the head's angles and stay on their target (the
vestibulo-ocular reflex of ``gazerig.gaze.oculomotor.oculomotor``).
"""

from collections.abc import Mapping
from typing import NamedTuple

from gazerig.gaze.mouth.speech_track import SPEECH
from gazerig.gaze.track.expression import Expressions
from gazerig.gaze.track.level import LevelRange, Levels
from gazerig.gaze.track.pose_offset import NO_OFFSET, PoseOffset
from gazerig.gaze.track.track import POSE_CHANNELS
from gazerig.gaze.track.track_player import TrackPlayer

_FIRST_JOINT = len(POSE_CHANNELS)


class AnimationTables(NamedTuple):
    """Tables of a rig's animations.

    expressions: offset of each at full strength; blend_s: time from one to another
    mouth: the level that opens the mouth, None without one
    """

    expressions: Mapping[str, PoseOffset]
    blend_s: float
    levels: Mapping[str, LevelRange]
    mouth: LevelRange | None = None


NO_TABLES = AnimationTables({}, 0.5, {})


class Animation:
    """Sum of all motions besides gaze, as one offset per tick.

    expressions, levels, tracks: parts that accept the commands
    """

    def __init__(self, joints: tuple[str, ...] = (), tables: AnimationTables = NO_TABLES) -> None:
        """Create it at rest.

        Args:
            joints: from ``gazerig.robot.model.types.further_joints``.
            tables: expressions and levels.
        """
        self.expressions = Expressions(tables.expressions, tables.blend_s, len(joints))
        self.levels = Levels(tables.levels, len(joints))
        self.tracks = TrackPlayer(len(joints), self.expressions)
        self._sum = NO_OFFSET
        self._mouth = tables.mouth

    def reset(self, t_s: float) -> None:
        """Begin at rest at a time."""
        self.expressions.reset()
        self.levels.reset()
        self.tracks.reset()

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset of the pose in this tick."""
        expressions, levels, tracks = self.expressions, self.levels, self.tracks
        if expressions.moves or levels.moves or tracks.moves:
            face = expressions.step(t_s).combine(levels.step(t_s))
            self._sum = face.combine(tracks.step(t_s))
            if tracks.owned.layers:
                joints = [
                    tracks.owned.mix(_FIRST_JOINT + i, a)
                    for i, a in enumerate(self._sum.joints_rad)
                ]
                self._sum = self._sum._replace(joints_rad=tuple(joints), owned=tracks.owned)
        return self._sum

    @property
    def loudness(self) -> float | None:
        """Return the loudness 0..1 of a speech by its mouth, 1 without one; None: no speech."""
        if not any([one.name == SPEECH for one in self.tracks.voices]):
            return None
        return 1.0 if self._mouth is None else self._mouth.value_of(self._sum)
