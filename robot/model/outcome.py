"""Outcomes of commands, from the replies and the progress of the head."""

from typing import Literal, NamedTuple

from gazerig.robot.model.client_control import ARRIVED_RAD
from gazerig.robot.model.control_source import (
    NO_CLIENT_CONTROL,
    NO_GESTURE,
    ControlState,
    GestureState,
)
from gazerig.robot.model.reply import CommandReply

Outcome = Literal["arrived", "refused", "out of reach", "taken over", "timed out"]
"""How an order ended.

arrived: the gaze was measured within 1 degree of the point, or the joint within 1 degree of its
    angle; a gesture has ended; any other order was accepted
refused: nothing was done; ``Order.why`` gives the reason
out of reach: the gaze will rest more than 1 degree off the point, at the limits of the joints.
    This is known as soon as the reply arrives. ``Order.why`` gives the error, and the joints that
    limit it. The order keeps control, and the head goes as far as it can
taken over: something else moves the head now, or control has ended; ``Order.why`` gives the reason
timed out: none of these within the given time
"""


class Progress(NamedTuple):
    """The progress of a client's command and of a gesture.

    Attributes:
        lead, gesture: The newest ones.
        led: Client that controls gaze or joints, and its command; "" without one.
    """

    lead: ControlState = NO_CLIENT_CONTROL
    gesture: GestureState = NO_GESTURE
    led: str = ""


def command_outcome(reply: CommandReply, now: Progress) -> tuple[Outcome, str] | None:
    """Return the outcome of a command and the reason for it, None while it is in progress."""
    played = reply.gesture.number if reply.gesture is not None else 0
    if reply.refused:
        return "refused", reply.refused
    if played:
        newest = now.gesture
        if newest.number > played:
            return "taken over", f"another gesture: {newest.name or newest.ended}"
        if newest.number < played or newest.name and not newest.ended:
            return None
        return ("taken over", newest.ended) if newest.ended else ("arrived", "")
    if reply.lead == 0:  # it takes no control: done as soon as accepted
        return "arrived", ""
    if reply.error_rad > ARRIVED_RAD:
        return "out of reach", reply.text()
    if now.lead.number == reply.lead:
        if now.lead.arrived:
            return "arrived", ""
        return None if now.lead.active else ("taken over", now.lead.ended)
    return ("taken over", now.led or now.lead.ended) if now.lead.number > reply.lead else None
