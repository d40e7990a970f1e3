"""Replies to commands, and their outcomes from the replies and the progress of the head."""

import threading
from collections.abc import Callable
from math import radians
from typing import Literal

from msgspec import Struct

from gazerig.robot.model.commands import Command
from gazerig.robot.model.control_source import (
    FINISHED,
    NO_CLIENT_CONTROL,
    ControlState,
    TrackState,
)

ARRIVED_RAD = radians(1.0)
"""A gaze or joint has arrived if its measured error is below this."""


class TrackReply(Struct, frozen=True):
    """The reply for a track that starts, or with name "" for the end of the present one.

    Attributes:
        name: Name of the track.
        duration_s: Time until everything is at rest again.
        limited: Where it is slower or smaller than defined, and what the rig lacks; "" if nothing.
        number: Number of the track (``gazerig.robot.model.control_source.TrackState``).
    """

    name: str
    duration_s: float
    limited: str = ""
    number: int = 0

    def text(self) -> str:
        """Return one line for users."""
        if not self.name:
            return f"tracks end within {self.duration_s:.2f} s"
        return f"{self.name} takes {self.duration_s:.1f} s{self.limited and f'; {self.limited}'}"


class CommandReply(Struct, frozen=True):
    """The robot's reply to one command on its execution.

    Attributes:
        refused: Reason for a refusal, "" if the command is executed.
        control_number: Number of the control that it started (``ControlState``),
            0 for none.
        track: Track that is played, None for other commands.
        t_s: Time of the tick that executed it.
    """

    refused: str = ""
    control_number: int = 0
    track: TrackReply | None = None
    t_s: float = 0.0

    def text(self) -> str:
        """Return one line for users, "" if there is nothing to report."""
        if self.refused:
            return f"refused: {self.refused}"
        return self.track.text() if self.track is not None else ""


class Ticket:
    """A ticket for the reply to one command, which the loop's thread gives."""

    def __init__(self) -> None:
        self._answered = threading.Event()
        self._reply = CommandReply()

    def answer(self, reply: CommandReply) -> None:
        """Give the reply."""
        self._reply = reply
        self._answered.set()

    def wait(self, within_s: float) -> CommandReply | None:
        """Wait for the reply; return None if the loop has not executed the command in time."""
        return self._reply if self._answered.wait(within_s) else None


CommandTaker = Callable[[Command], Ticket | None]
"""Accepts a command for the next tick, like Robot.command; returns None if there is no reply."""


Outcome = Literal["arrived", "refused", "out of reach", "taken over", "timed out"]
"""How an order ended.

arrived: the gaze was measured within 1 degree of the point, or the joint within 1 degree of its
    angle; a track has ended; any other order was accepted
refused: nothing was done; ``Order.why`` gives the reason
out of reach: the gaze rests more than 1 degree off the point, at the limits of the joints.
    ``Order.why`` gives the error, and the angles that limit it. The order keeps control, and the
    head goes as far as it can
taken over: another source controls the head now, or control has ended; ``Order.why`` gives
    the reason
timed out: none of these within the given time
"""


class Progress(Struct, frozen=True):
    """The progress of a client's command and of tracks.

    Attributes:
        client_control: The newest one.
        tracks: Those that play and the last ones that have ended.
    """

    client_control: ControlState = NO_CLIENT_CONTROL
    tracks: tuple[TrackState, ...] = ()


def command_outcome(reply: CommandReply, now: Progress) -> tuple[Outcome, str] | None:
    """Return the outcome of a command and the reason for it, None while it is in progress."""
    played = reply.track.number if reply.track is not None else 0
    if reply.refused:
        return "refused", reply.refused
    if played:
        if not now.tracks or now.tracks[-1].number < played:
            return None
        track = next((one for one in now.tracks if one.number == played), None)
        if track is None:
            return "taken over", f"another track: {now.tracks[-1].name}"
        if track.is_playing:
            return None
        finished = track.end_reason == FINISHED
        return ("arrived", "") if finished else ("taken over", track.end_reason)
    if reply.control_number == 0:  # it takes no control: done as soon as accepted
        return "arrived", ""
    control = now.client_control
    if control.number < reply.control_number:
        return None
    if control.number > reply.control_number:
        return "taken over", control.client or control.end_reason
    if control.arrived:
        return "arrived", ""
    if not control.active:
        return "taken over", control.end_reason
    return ("out of reach", control.limited) if control.limited else None
