"""Gestures of a robot: the available ones, their fit to this rig, and their start."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gazerig.gaze.gesture.gesture import Gesture, GestureParams
from gazerig.gaze.gesture.gesture_player import GesturePlayer
from gazerig.robot.model.commands import Play
from gazerig.robot.model.control_source import NO_GESTURE, GestureState
from gazerig.robot.model.gesture_fit import (
    FittedGesture,
    GestureFit,
    GestureMotions,
    GestureRefused,
    gesture_motions,
)
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.reply import CommandReply, GestureReply
from gazerig.robot.model.types import JointAngles

_MOST_KEPT = 64
"""Number of gestures with a non-default count whose curves are cached."""


class GestureInfo(NamedTuple):
    """A gesture on this rig, played from the middle of all ranges.

    Attributes:
        name: Name of the gesture.
        description: Its description.
        duration_s: Duration in s, 0 if it is refused.
        slowed_by: Factor by which it takes longer than defined.
        refused: Reason why this rig cannot do it, "" if it can.
    """

    name: str
    description: str
    duration_s: float = 0.0
    slowed_by: float = 1.0
    refused: str = ""


class GestureChoices:
    """The gestures of one rig.

    Args:
        gestures: All known gestures by name.
        player: Plays them.
        params: Share of the joints' limits that they may use.
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
    """

    def __init__(
        self,
        gestures: Mapping[str, Gesture],
        player: GesturePlayer,
        params: GestureParams,
        joints: tuple[str, ...],
        lid_spans_rad: Mapping[str, float],
    ) -> None:
        self._gestures, self._player, self._joints = gestures, player, joints
        self._state = NO_GESTURE
        self._cache: dict[tuple[str, int], GestureMotions | GestureRefused] = {}
        self.retune(params, lid_spans_rad)
        for name in gestures:
            self._motions(name, 0)

    def retune(self, params: GestureParams, lid_spans_rad: Mapping[str, float]) -> None:
        """Change the share of limits and the lids' ranges for the next gesture."""
        self._params = params
        self._fit = GestureFit(self._joints, lid_spans_rad)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the gestures whose joints this rig has."""
        return tuple(
            name for name in self._gestures if not isinstance(self._motions(name, 0), Exception)
        )

    @property
    def playing(self) -> str:
        """Return the present gesture, "" if there is none."""
        return self._player.playing

    @property
    def state(self) -> GestureState:
        """Return the newest gesture and its state."""
        if self._state.name and not self._player.playing:
            self._state = self._state._replace(name="")
        return self._state

    def require(self, command: Play) -> None:
        """Check that a gesture exists, and compute its curves. Thread-safe.

        Raises:
            ValueError: There is no such gesture; the message lists the available ones.
        """
        if not command.gesture:
            return
        if command.gesture not in self._gestures:
            there = ", ".join(self.names)
            raise ValueError(f"no gesture {command.gesture!r}; available: {there}")
        made = self._motions(command.gesture, command.times)
        if isinstance(made, GestureRefused):
            raise ValueError(f"{command.gesture}: {made}")

    def all_gestures(self, limits: Sequence[JointLimit]) -> tuple[GestureInfo, ...]:
        """Return all gestures with their fit to this rig.

        Args:
            limits: Limits of the joints.
        """
        return tuple(self._info(name, gesture, limits) for name, gesture in self._gestures.items())

    def _info(self, name: str, gesture: Gesture, limits: Sequence[JointLimit]) -> GestureInfo:
        middle = np.clip(0.0, [one.low_rad for one in limits], [one.high_rad for one in limits])
        try:
            fitted = self._fit_gesture(name, 0, 1.0, middle, limits)
        except GestureRefused as refused:
            return GestureInfo(name, gesture.description, refused=str(refused))
        return GestureInfo(name, gesture.description, fitted.gesture.duration_s, fitted.slowed_by)

    def play(
        self, command: Play, t_s: float, commanded_rad: JointAngles, limits: Sequence[JointLimit]
    ) -> CommandReply:
        """Start a gesture from the joints' present angles, or end the present one.

        Args:
            command: Gesture, speed and count.
            t_s: Present time.
            commanded_rad: Joint angles last sent.
            limits: Present limits of the joints.
        """
        share, state = self._params.limit_share, self._player.state(t_s)
        fade_s = self._fit.fade_s(state, limits, share, self._params.blend_out_ms / 1e3)
        by = command.who or "a user"
        if not command.gesture:
            self._player.play(None, t_s, fade_s, 0.0)
            if self.state.name:
                self._state = self._state._replace(name="", end_reason=f"{by} has ended it")
            return CommandReply(gesture=GestureReply("", fade_s))
        base = self._fit.subtract_offset(commanded_rad, state)
        try:
            fitted = self._fit_gesture(command.gesture, command.times, command.speed, base, limits)
        except GestureRefused as refused:
            return CommandReply(f"{command.gesture}: {refused}")
        wait_s = self._fit.wait_s(state, fade_s, fitted.gesture, limits, share)
        self._player.play(fitted.gesture, t_s, fade_s, wait_s)
        number = self._state.number + 1
        self._state = GestureState(number, command.gesture, who=command.who, since_s=t_s)
        left_out = self._require_motions(command.gesture, command.times).left_out
        return CommandReply(
            gesture=GestureReply(
                command.gesture,
                wait_s + fitted.gesture.duration_s,
                fitted.slowed_by,
                fitted.slow_joint,
                fitted.reduced_joints,
                left_out,
                self._state.number,
            )
        )

    def drop_present(self) -> str:
        """Drop the present gesture, as a client holds its joints or the torque is off.

        Returns:
            The name of the gesture, "" if there was none.
        """
        name = self._player.playing
        self._player.reset()
        if name:
            self._state = self._state._replace(
                name="", end_reason="its joints are controlled by a client or switched off"
            )
        return name

    def _fit_gesture(
        self,
        name: str,
        count: int,
        speed: float,
        base_rad: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
        limits: Sequence[JointLimit],
    ) -> FittedGesture:
        made = self._require_motions(name, count)
        return self._fit.fit(name, made, speed, base_rad, limits, self._params.limit_share)

    def _require_motions(self, name: str, count: int) -> GestureMotions:
        made = self._motions(name, count)
        if isinstance(made, GestureRefused):
            raise made
        return made

    def _motions(self, name: str, count: int) -> GestureMotions | GestureRefused:
        """Return the curves of a gesture, or the reason why this rig has none."""
        key = name, count if count != self._gestures[name].count else 0
        if key not in self._cache:
            if len(self._cache) >= len(self._gestures) + _MOST_KEPT:
                self._cache = {kept: made for kept, made in self._cache.items() if kept[1] == 0}
            try:
                self._cache[key] = gesture_motions(self._gestures[name], self._joints, count)
            except GestureRefused as refused:
                self._cache[key] = refused
        return self._cache[key]
