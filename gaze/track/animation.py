"""Motion added to gaze: tracks, expressions and levels as one change of the pose.

An expression is a named offset that blends in over time. A level is a value 0..1 that a program
sets many times per second, such as the opening of a jaw. Gaze continues: the eyes compensate
offsets of the head's angles and stay on their target (the vestibulo-ocular reflex of
``gazerig.gaze.oculomotor.oculomotor``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Annotated, NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import MinimumJerkBlend
from gazerig.gaze.track.player import TrackPlayer
from gazerig.gaze.track.track import LIDS, NO_OFFSET, PoseOffset
from gazerig.gaze.types import Floats
from gazerig.params import Bounds, unknown_text

HOLD_S = 0.5
"""A level that was not set for this time returns to 0, as its program may have ended."""
MOUTH = "mouth"
"""The level that opens the mouth of a rig that has one."""
NEUTRAL = "neutral"
"""The initial expression; without an entry in the rig's table all its offsets are 0."""


@dataclass(frozen=True)
class LevelParams:
    """Motion of one level."""

    # fmt: off
    joint: Annotated[str, "joint that the level moves: any but those of the eyes"]
    low_deg: Annotated[float, Bounds(-180, 180), "angle added to the joint at level 0"]
    high_deg: Annotated[float, Bounds(-180, 180), "angle added to the joint at level 1"]
    smoothing_ms: Annotated[float, Bounds(10, 500), "time within which the joint follows a step of the level"] = 80.0
    # fmt: on


class Face(NamedTuple):
    """An expression or a level of a rig.

    kind: "expression" or "level"
    low, change: (channels,) offsets from rest at 0, and their change to 1
    smoothing_s: time of a step
    """

    kind: str
    low: Floats
    change: Floats
    smoothing_s: float


class Animation:
    """Sum of all motions besides gaze, as one change of the pose per tick.

    Args:
        joints: Joints that gaze does not move.
        faces: Expressions, neutral first, and levels by name.

    Attributes:
        tracks: Player of tracks.
        names: Names of expressions, neutral first, and of levels.
        expression: Name of the present expression.
    """

    def __init__(self, joints: tuple[str, ...] = (), faces: Mapping[str, Face] = {}) -> None:
        self.tracks = TrackPlayer(len(joints))
        self._faces = faces
        self.names = {
            kind: tuple([name for name, face in faces.items() if face.kind == kind])
            for kind in ("expression", "level")
        }
        self._blends = {
            name: MinimumJerkBlend((float(name == NEUTRAL),), face.smoothing_s)
            for name, face in self._faces.items()
        }
        self.expression = NEUTRAL
        self._until_s: dict[str, float] = {}
        self._speaks = self._at_rest = False
        self._offset = NO_OFFSET

    def require(self, kind: str, name: str) -> None:
        """Raise ValueError for an unknown expression or level; the message lists the known ones."""
        known = self.names[kind]
        if name not in known and (kind, name) != ("expression", NEUTRAL):
            remedy = f"none: add a table {kind}s to the rig"
            raise ValueError(unknown_text(kind, name, known, remedy))

    def set_face(self, kind: str, name: str, value: float, t_s: float) -> None:
        """Move to an expression, or set a level, to a share 0..1 of it from the next step on.

        Raises:
            ValueError: It is unknown; the message lists the known ones.
        """
        self.require(kind, name)
        self._at_rest = False
        if kind == "level":
            self._until_s[name] = t_s + HOLD_S if value > 0.0 else inf
        else:
            self.expression = name
            for other in self.names[kind]:
                self._blends[other].move_to((0.0,))
        if name in self._blends:
            self._blends[name].move_to((value,))

    def drop_lapsed(self, t_s: float) -> list[str]:
        """Drop levels to 0 that were not set for ``HOLD_S``; return their names."""
        lapsed = [name for name, until_s in self._until_s.items() if t_s >= until_s]
        for name in lapsed:
            self.set_face("level", name, 0.0, t_s)
        return lapsed

    def step(self, t_s: float) -> PoseOffset:
        """Return the change of the pose in this tick; at rest it is the same object."""
        if self._at_rest and not self.tracks.moves:
            return self._offset
        factors, added = self.tracks.step(t_s)
        self._speak(t_s)
        shares = {name: blend.step(t_s)[0] for name, blend in self._blends.items()}
        self._mouth = shares.get(MOUTH, 1.0)
        self._at_rest = all([blend.is_at_rest for blend in self._blends.values()])
        offset = np.zeros(len(added))
        for name, face in self._faces.items():
            offset += face.low + shares[name] * face.change
        factors[LIDS] *= 1.0 + offset[LIDS]
        offset[LIDS] = 0.0
        added += factors * offset
        self._offset = PoseOffset(tuple(factors.tolist()), tuple(added.tolist()))
        return self._offset

    def _speak(self, t_s: float) -> None:
        """Let the mouth follow a speech that knows its openings; it shuts at the end of any."""
        speech = self.tracks.speech
        if MOUTH in self.names["level"]:
            if speech is not None and speech.motion.mouth.size:
                opening = np.interp(speech.time_s, *speech.motion.mouth)
                self.set_face("level", MOUTH, float(opening), t_s)
            elif speech is None and self._speaks:
                self.set_face("level", MOUTH, 0.0, t_s)
        self._speaks = speech is not None

    @property
    def loudness(self) -> float | None:
        """Return the loudness 0..1 of a speech by its mouth, 1 without one; None: no speech."""
        return self._mouth if self.tracks.speech is not None else None
