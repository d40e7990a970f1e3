"""What clients are told: control of the head, conversation and tracks, replies and outcomes.

The page, the status line, other programs, recordings and Python all use these values and texts.
"""

import threading
from collections.abc import Callable, Sequence
from math import radians
from typing import Literal

from msgspec import Struct

from gazerig.gaze.attention.finding import Found
from gazerig.gaze.track.track import FINISHED as FINISHED
from gazerig.gaze.track.track import TrackState as TrackState
from gazerig.gaze.types import TurnState
from gazerig.robot.model.commands import Command

CHARACTERS_PER_S = 15.0
"""Rate of speech, for the end of a text without times: about 150 English words a minute."""


class ControlState(Struct, frozen=True):
    """The newest control by a client, after a tick.

    Attributes:
        number: Number of the control since the start, 0 before the first.
        active: Whether it is active.
        arrived: Whether the measured gaze has reached the point, or the joints their angles.
        error_rad: Measured error of the gaze or of the worst joint, 0 while not active.
        end_reason: Reason for its end, "" while it is active.
        kind: Kind while it is active: a person or program that chose the target, a person's mouse
            pointer, or held joints.
        who: Name of the client.
        description: Command as text, e.g. "look at 1 0 0.3", "neck_yaw at 17.2 deg".
        joints: Held joints.
        limited: Error of a gaze that rests off its point, and the angles that limit it, else "".
        found: Person whom a search has found, None without one.
    """

    number: int = 0
    active: bool = False
    arrived: bool = False
    error_rad: float = 0.0
    end_reason: str = ""
    kind: Literal["person", "pointer", "joint"] = "person"
    who: str = ""
    description: str = ""
    joints: tuple[str, ...] = ()
    limited: str = ""
    found: Found | None = None

    @property
    def client(self) -> str:
        """Return the client and its command, e.g. "ann: look at 1 0 0.3", "" if not active."""
        return f"{self.who or 'a client'}: {self.description}" if self.active else ""


NO_CLIENT_CONTROL = ControlState()
NOT_FOUND = "nobody was found"
"""Reason for the end of a search."""


class ConversationState(Struct, frozen=True):
    """State of the conversation after a tick.

    Attributes:
        number: Number of the state since the start, 0 before the first; a plan that changes during
            speech keeps it.
        state: What the voice agent does; interrupted: it listens, after an interruption.
        partner: Perception's number of the person, None if unknown.
        since_s: Start of the state.
        ends_s: Planned end of speech, None if unknown.
        confidence: Confidence of the planned end, 0..1.
        text: Beginning of the spoken text.
        who: Name of the client, "" without one.
        end_reason: Reason for an end that no client has requested, "" otherwise.
    """

    number: int = 0
    state: TurnState = "idle"
    partner: int | None = None
    since_s: float = 0.0
    ends_s: float | None = None
    confidence: float = 0.0
    text: str = ""
    who: str = ""
    end_reason: str = ""


NO_CONVERSATION = ConversationState()

ControlKind = Literal["gaze", "person", "pointer", "joint", "track", "stopped", "parking"]
"""gaze: no client, the head chooses; person: a person or program chose the target; pointer: the
target is a person's mouse pointer; joint: joints are held."""


class ControlSource(Struct, frozen=True):
    """The source of control, and its command.

    Attributes:
        kind: Kind of control.
        who: Name of the client for display, "" for none or unknown.
        description: "look at 1 0 0.3", "neck_yaw at 17.2 deg", a track's name, a stop's reason.
        joints: Held joints, or those that tracks own.
    """

    kind: ControlKind = "gaze"
    who: str = ""
    description: str = ""
    joints: tuple[str, ...] = ()

    @property
    def overrides_gaze(self) -> bool:
        """Return whether something other than the gaze models moves or holds the head."""
        return self.kind not in ("gaze", "track")


def control_source(
    stopped: str, parking: bool, lead: ControlState, tracks: Sequence[TrackState]
) -> ControlSource:
    """Return the source of control.

    Args:
        stopped: Reason for a stop, "" while the robot moves.
        parking: Whether the run is over and the head moves to its parking pose.
        lead: The newest control by a client.
        tracks: The tracks.
    """
    if stopped:
        return ControlSource("stopped", "", stopped)
    if parking:
        return ControlSource("parking")
    if lead.active:
        who = lead.who or "a client"
        return ControlSource(lead.kind, who, lead.description, lead.joints)
    if playing := [track for track in tracks if track.is_playing]:
        # The newest, with a sound if one has it.
        newest = max(playing, key=lambda track: (bool(track.sound), track.number))
        owns = tuple(joint for track in playing for joint in track.owns)
        names = " and ".join(track.name for track in playing)
        return ControlSource("track", newest.who, names, owns)
    return ControlSource()


def control_sentence(leader: ControlSource) -> str:
    """Return the source of control as a sentence, "ann holds neck_yaw at 17.2 deg"."""
    match leader.kind:
        case "gaze":
            return "no client is in control: the head chooses its own targets"
        case "person":
            return f"{leader.who} makes it {leader.description}"
        case "pointer":
            return f"it looks at the pointer of {leader.who}"
        case "joint":
            return f"{leader.who} holds {leader.description}"
        case "track":
            return f"it plays {leader.description}" + (f" for {leader.who}" if leader.who else "")
        case "stopped":
            return f"stopped: {leader.description}; the torque is off"
        case "parking":
            return "it moves to its parking pose, then the torque goes off"


ARRIVED_RAD = radians(1.0)
"""A gaze or joint has arrived if its measured error is below this."""


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
    track: TrackState | None = None
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


Outcome = Literal["arrived", "refused", "out of reach", "not found", "taken over", "timed out"]
"""How an order ended.

arrived: the gaze was measured within 1 degree of the point, or the joint within 1 degree of its
    angle; a track has ended; any other order was accepted. ``Order.why`` gives a found person
refused: nothing was done; ``Order.why`` gives the reason
out of reach: the gaze rests more than 1 degree off the point, at the limits of the joints.
    ``Order.why`` gives the error, and the angles that limit it. The order keeps control, and the
    head goes as far as it can
not found: a search has found nobody
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
        return "arrived", control.found.text() if control.found is not None else ""
    if not control.active:
        return "not found" if control.end_reason == NOT_FOUND else "taken over", control.end_reason
    return ("out of reach", control.limited) if control.limited else None
