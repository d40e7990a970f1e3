"""Motion added to gaze: tracks, expressions and levels as offsets of the head's pose.

An expression is a named offset that blends in over time. A level is a value 0..1 that a program
sets many times per second, such as the opening of a jaw. Gaze continues: the eyes compensate
offsets of the head's angles and stay on their target (the vestibulo-ocular reflex of
``gazerig.gaze.oculomotor.oculomotor``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import MinimumJerkBlend
from gazerig.gaze.track.player import TrackPlayer
from gazerig.gaze.track.pose_offset import PoseOffset
from gazerig.gaze.types import Floats
from gazerig.params import Bounds, unknown_text

HOLD_S = 0.5
"""A level that was not set for this time returns to 0, as its program may have ended."""
MOUTH = "mouth"
"""The level that opens the mouth of a rig that has one."""
NEUTRAL = "neutral"
"""The initial expression; without an entry in the rig's table all its offsets are 0."""
_LIDS = slice(5, 9)


@dataclass(frozen=True)
class LevelParams:
    """Motion of one level."""

    # fmt: off
    joint: Annotated[str, "joint that the level moves: any but those of the eyes"]
    low_deg: Annotated[float, Bounds(-180, 180), "angle added to the joint at level 0"]
    high_deg: Annotated[float, Bounds(-180, 180), "angle added to the joint at level 1"]
    smoothing_ms: Annotated[float, Bounds(10, 500), "time within which the joint follows a step of the level"] = 80.0
    # fmt: on


class FaceRange(NamedTuple):
    """An expression or a level: flat offsets from rest at 0, their change to 1, time of a step."""

    low: Floats
    gain: Floats
    smoothing_s: float


class FaceTables(NamedTuple):
    """Expressions of a rig, neutral first, and its levels."""

    expressions: Mapping[str, FaceRange]
    levels: Mapping[str, FaceRange]

    @property
    def ranges(self) -> dict[str, FaceRange]:
        """Return all by their names."""
        return {**self.expressions, **self.levels}


NO_TABLES = FaceTables({}, {})


class Animation:
    """Sum of all motions besides gaze, as one offset per tick.

    Args:
        joints: Joints that gaze does not move.
        tables: Expressions and levels.

    Attributes:
        tracks: Player of tracks.
        expression: Name of the present expression.
    """

    def __init__(self, joints: tuple[str, ...] = (), tables: FaceTables = NO_TABLES) -> None:
        self.tracks = TrackPlayer(len(joints))
        self._tables = tables
        self._gains = [one.gain for one in tables.ranges.values()]
        self._low: Floats = sum([one.low for one in tables.ranges.values()], self.tracks.rest)
        self._blends = {
            name: MinimumJerkBlend((float(name == NEUTRAL),), one.smoothing_s)
            for name, one in self._tables.ranges.items()
        }
        self.expression = NEUTRAL
        self._until_s: dict[str, float] = {}
        self._mouth, self._speaks = 1.0, False
        self._face, self._at_rest = self._low, False
        self._sum = PoseOffset.from_flat(self._low.tolist())

    @property
    def expressions(self) -> tuple[str, ...]:
        """Return the known expressions, neutral first; empty if the rig has no table."""
        return tuple(self._tables.expressions)

    def require(self, kind: str, name: str) -> None:
        """Raise ValueError for an unknown expression or level; the message lists the known ones."""
        known = self._tables.expressions if kind == "expression" else self._tables.levels
        if name not in known and (kind, name) != ("expression", NEUTRAL):
            remedy = f"none: add a table {kind}s to the rig"
            raise ValueError(unknown_text(kind, name, known, remedy))

    def express(self, name: str, strength: float = 1.0) -> None:
        """Move to an expression, from the next step on.

        Raises:
            ValueError: It is unknown; the message lists the known ones.
        """
        self.require("expression", name)
        self.expression, self._at_rest = name, False
        for other in self._tables.expressions:
            self._blends[other].move_to((strength if other == name else 0.0,))

    def set_level(self, name: str, value: float, t_s: float) -> None:
        """Set a level to a value 0..1, from the next step on.

        Raises:
            ValueError: It is unknown; the message lists the known ones.
        """
        self.require("level", name)
        self._blends[name].move_to((value,))
        self._at_rest = False
        self._until_s.pop(name, None)
        if value > 0.0:
            self._until_s[name] = t_s + HOLD_S

    def drop_lapsed(self, t_s: float) -> tuple[str, ...]:
        """Drop levels to 0 that were not set for ``HOLD_S``; return their names."""
        fallen = tuple([name for name, until_s in self._until_s.items() if t_s >= until_s])
        for name in fallen:
            self.set_level(name, 0.0, t_s)
        return fallen

    def step(self, t_s: float) -> PoseOffset:
        """Return the offset of the pose in this tick; at rest it is the same object."""
        tracks = self.tracks
        if self._at_rest and not tracks.moves:
            return self._sum
        moved = tracks.step(t_s)
        self._speak(t_s)
        if not self._at_rest:
            shares = {name: blend.step(t_s)[0] for name, blend in self._blends.items()}
            self._mouth = shares.get(MOUTH, 1.0)
            parts = zip(shares.values(), self._gains, strict=True)
            self._face = sum([share * gain for share, gain in parts], self._low)
            self._at_rest = all([blend.is_at_rest for blend in self._blends.values()])
        flat = self._face + moved
        flat[_LIDS] = self._face[_LIDS] * (1.0 + moved[_LIDS])
        self._sum = PoseOffset.from_flat(flat.tolist(), tracks.owned)
        return self._sum

    def _speak(self, t_s: float) -> None:
        """Let the mouth follow a speech that knows its openings; it shuts at the end of any."""
        speech = self.tracks.speech
        if MOUTH in self._tables.levels:
            if speech is not None and speech.motion.mouth is not None:
                opening = np.interp(speech.time_s(t_s), *speech.motion.mouth)
                self.set_level(MOUTH, float(opening), t_s)
            elif speech is None and self._speaks:
                self.set_level(MOUTH, 0.0, t_s)
        self._speaks = speech is not None

    @property
    def loudness(self) -> float | None:
        """Return the loudness 0..1 of a speech by its mouth, 1 without one; None: no speech."""
        return self._mouth if self.tracks.speech is not None else None
