"""Replies to commands, and their outcomes from the replies and the progress of the head."""

import threading
from collections.abc import Callable
from math import degrees, radians
from typing import Literal

from msgspec import Struct

from gazerig.gaze.angles import Vec3
from gazerig.robot.model.commands import Command
from gazerig.robot.model.control_source import (
    FINISHED,
    NO_CLIENT_CONTROL,
    ControlState,
    TrackState,
)

ARRIVED_RAD = radians(1.0)
"""A gaze or joint has arrived if its measured error is below this."""


class JointReply(Struct, frozen=True):
    """The reply for one commanded joint, in rad.

    Attributes:
        joint: Name of the joint.
        asked_rad: Commanded angle.
        done_rad: Angle that the joint will reach.
        low_rad, high_rad: Present range.
        reason: Reason why ``done_rad`` differs from ``asked_rad``, "" if it does not.
    """

    joint: str
    asked_rad: float
    done_rad: float
    low_rad: float
    high_rad: float
    reason: str

    def text(self) -> str:
        """Return one phrase for users."""
        if self.low_rad == self.high_rad:
            return f"{self.joint}: {self.reason}"
        if not self.reason:
            return f"{self.joint} to {degrees(self.done_rad):.1f} deg"
        return (
            f"{self.joint} stays at {degrees(self.done_rad):.1f} of {degrees(self.asked_rad):.1f} "
            f"deg ({self.reason}, {degrees(self.low_rad):g}..{degrees(self.high_rad):g})"
        )


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
        asked_m: Point to look at, None for other commands.
        done_m: Point at the same distance that the eyes will reach, None for other commands.
        joints: Joints that cannot reach their angles; for a jog, all commanded joints.
        error_rad: Angle between the point and the line of sight at the end of the motion, of the
            worse eye, or of the mean line of sight if one linkage pans both eyes.
        control_number: Number of the control that it started (``ControlState``),
            0 for none.
        track: Track that is played, None for other commands.
        t_s: Time of the tick that executed it.
    """

    refused: str = ""
    asked_m: Vec3 | None = None
    done_m: Vec3 | None = None
    joints: tuple[JointReply, ...] = ()
    error_rad: float = 0.0
    control_number: int = 0
    track: TrackReply | None = None
    t_s: float = 0.0

    @property
    def error_deg(self) -> float:
        """Return ``error_rad`` in degrees."""
        return degrees(self.error_rad)

    @property
    def limited(self) -> tuple[JointReply, ...]:
        """Return the joints that cannot reach their angles."""
        return tuple(joint for joint in self.joints if joint.reason)

    def text(self) -> str:
        """Return one line for users, "" if there is nothing to report."""
        if self.refused:
            return f"refused: {self.refused}"
        if self.track is not None:
            return self.track.text()
        ends = "; ".join(joint.text() for joint in self.joints)
        if self.asked_m is None:
            return ends
        if self.error_rad < ARRIVED_RAD:
            return "it looks there"
        return f"it looks {self.error_deg:.0f} deg off" + (f": {ends}" if ends else "")


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
out of reach: the gaze will rest more than 1 degree off the point, at the limits of the joints.
    This is known as soon as the reply arrives. ``Order.why`` gives the error, and the joints that
    limit it. The order keeps control, and the head goes as far as it can
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
    if reply.error_rad > ARRIVED_RAD:
        return "out of reach", reply.text()
    if now.client_control.number == reply.control_number:
        if now.client_control.arrived:
            return "arrived", ""
        return None if now.client_control.active else ("taken over", now.client_control.end_reason)
    return (
        ("taken over", now.client_control.client or now.client_control.end_reason)
        if now.client_control.number > reply.control_number
        else None
    )
