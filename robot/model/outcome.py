"""Outcomes of commands, from the replies and the progress of the head."""

from typing import Literal

from msgspec import Struct

from gazerig.gaze.track.track import FINISHED
from gazerig.robot.model.client_control import ARRIVED_RAD
from gazerig.robot.model.control_source import NO_CLIENT_CONTROL, ControlState, TrackState
from gazerig.robot.model.reply import CommandReply

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
        controlled_by: Client that controls gaze or joints, and its command; "" without one.
    """

    client_control: ControlState = NO_CLIENT_CONTROL
    tracks: tuple[TrackState, ...] = ()
    controlled_by: str = ""


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
        ("taken over", now.controlled_by or now.client_control.end_reason)
        if now.client_control.number > reply.control_number
        else None
    )
