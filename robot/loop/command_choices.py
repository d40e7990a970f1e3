"""Menus of a running robot, and checks of incoming commands."""

from collections.abc import Callable, Mapping, Sequence
from math import degrees, radians

from gazerig.gaze.attention.conversation import MODES, ConversationGaze
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.track.animation import Animation
from gazerig.robot.loop.track_choices import TrackChoices
from gazerig.robot.model.commands import (
    NO_TRACK,
    Ask,
    Command,
    Express,
    Jog,
    Play,
    Say,
    SetLevel,
    Speak,
)
from gazerig.robot.model.conversation import ConversationState
from gazerig.robot.model.joint import JointLimit

_NEAR_END_RAD = radians(0.05)
"""A slider at the end of a joint's range is rounded to a tenth of a degree."""

LID_COMMANDS: dict[str, Callable[[Lids, float], None]] = {
    "wink left": lambda lids, t_s: lids.wink("left", t_s),
    "wink right": lambda lids, t_s: lids.wink("right", t_s),
}
"""Commands for the lids."""


class Menus:
    """The menus of behaviours, conversation, lids, expressions and tracks."""

    def __init__(
        self, gaze: ConversationGaze, lids: Lids, animation: Animation, tracks: TrackChoices
    ) -> None:
        self._gaze = gaze
        self._lids = lids
        self._animation = animation
        self._tracks = tracks

    def choices(self, top_down: TopDown) -> dict[str, tuple[str, ...]]:
        """Return menu -> choices, the present one first."""
        menus = {
            "behaviour": _put_first(top_down.chosen_behaviour, top_down.behaviours),
            "conversation": _put_first(self._gaze.chosen_mode, MODES),
            "lids": tuple(LID_COMMANDS),
        }
        if names := self._animation.expressions:
            menus["expression"] = _put_first(self._animation.expression, names)
        menus["track"] = _put_first(
            self._tracks.playing or NO_TRACK, (NO_TRACK, *self._tracks.names)
        )
        return menus

    def choose(self, command: Ask, top_down: TopDown, t_s: float) -> None:
        """Apply a choice that ``refuse_unknown`` accepted."""
        if command.menu == "behaviour":
            top_down.behave(command.choice)
        elif command.menu == "conversation":
            self._gaze.choose_mode(command.choice, t_s)
            self._set_blinks()
        elif command.menu == "expression":
            self._animation.express(command.choice)
        else:
            LID_COMMANDS[command.choice](self._lids, t_s)

    def converse(self, state: ConversationState, t_s: float) -> None:
        """Let gaze and lids follow a state of conversation; when idle, the chosen mode."""
        self._gaze.enter(state.state, state.partner, state.ends_s, state.confidence, t_s)
        self._set_blinks()

    def _set_blinks(self) -> None:
        self._lids.set_conversation(self._gaze.converses)


def refuse_impossible(
    command: Command,
    menus: Callable[[], Mapping[str, Sequence[str]]],
    joints: Sequence[str],
    animation: Animation,
    tracks: TrackChoices,
    limits: Sequence[JointLimit],
) -> None:
    """Refuse a command that names something that this robot does not have.

    Args:
        command: Command that has passed the general checks.
        menus: Returns the menus.
        joints: Joints of the rig.
        animation: Expressions and levels of the rig.
        tracks: Tracks of the rig.
        limits: Limits of the joints.

    Raises:
        ValueError: The message lists the available choices.
    """
    if isinstance(command, Ask):
        refuse_unknown(command, menus())
    elif isinstance(command, Jog):
        refuse_absent(command, joints)
    elif isinstance(command, Express):
        animation.require("expression", command.expression)
    elif isinstance(command, SetLevel):
        animation.require("level", command.level)
    elif isinstance(command, Say):
        raise ValueError("this run has no voice")
    elif isinstance(command, Play | Speak):
        tracks.require(command, limits)


def refuse_unknown(command: Ask, menus: Mapping[str, Sequence[str]]) -> None:
    """Refuse a choice that is on no menu.

    Raises:
        ValueError: The message lists the available choices.
    """
    if command.menu not in menus:
        raise ValueError(f"no menu {command.menu!r}; available: {', '.join(menus)}")
    if command.choice not in menus[command.menu]:
        there = ", ".join(menus[command.menu])
        raise ValueError(f"no {command.menu} {command.choice!r}; available: {there}")


def refuse_absent(command: Jog, joints: Sequence[str]) -> None:
    """Refuse joints that the rig does not have.

    Raises:
        ValueError: The message lists the rig's joints.
    """
    for name, _ in command.angles_rad:
        if name not in joints:
            raise ValueError(f"this rig has no joint {name!r}; available: {', '.join(joints)}")


def refuse_out_of_range(command: Jog, joints: Sequence[str], limits: Sequence[JointLimit]) -> None:
    """Refuse angles outside the joints' present ranges.

    Raises:
        ValueError: The message names each such joint and its range.
    """
    ranges = dict(zip(joints, limits, strict=True))
    outside = []
    for name, angle in command.angles_rad:
        low, high = ranges[name][:2] if name in ranges else (angle, angle)
        if not low - _NEAR_END_RAD <= angle <= high + _NEAR_END_RAD:
            outside.append(
                f"{name} {degrees(angle):.1f} deg is outside its range, "
                f"{degrees(low):g}..{degrees(high):g} deg"
            )
    if outside:
        raise ValueError("; ".join(outside))


def _put_first(present: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names with the present choice first."""
    return (present, *(name for name in names if name != present))
