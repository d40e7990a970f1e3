"""Who leads the head, as one value, and in the words that everybody is shown.

The page, the status line, other programs and Python all say it with these words.
"""

from typing import Literal, NamedTuple

LeaderKind = Literal[
    "gaze", "person", "pointer", "joint", "gesture", "stopped", "parking", "recording"
]
"""gaze: nobody, the head chooses; person: a person or program chose what to look at; pointer: it
looks at somebody's mouse pointer; joint: joints are held; recording: a recorded run is shown."""

_WORTH_TELLING_S = 1.0
"""How long somebody has led is said from here on."""
_MINUTE_S = 60.0


class LeadState(NamedTuple):
    """The newest lead, as it is after a tick.

    number: counts the leads since the start; 0 before the first
    active: it is in force
    arrived: the gaze has been measured on the point, or the joints at their angles, since
    error_rad: between gaze and point, or of the worst joint, as measured; 0 while not active
    ended: why it is not in force any more, "" while it is
    by: what leads while it is in force: a person or program that chose what to look at, somebody's
        pointer, or joints that are held
    who: asked for it, as given; what: e.g. "look at 1 0 0.3"; joints: those that are held
    since_s: since when the same client leads in this way without a break
    """

    number: int = 0
    active: bool = False
    arrived: bool = False
    error_rad: float = 0.0
    ended: str = ""
    by: Literal["person", "pointer", "joint"] = "person"
    who: str = ""
    what: str = ""
    joints: tuple[str, ...] = ()
    since_s: float = 0.0


class GestureState(NamedTuple):
    """The newest gesture, as it is after a tick.

    number: counts the gestures since the start; 0 before the first
    name: of the one under way, "" where there is none
    ended: why it is over, "" where it has come to its own end or is under way
    who: asked for it, "" where that is not known; since_s: when it began
    """

    number: int = 0
    name: str = ""
    ended: str = ""
    who: str = ""
    since_s: float = 0.0


NOBODY_LEADS = LeadState()
NO_GESTURE = GestureState()


class Leader(NamedTuple):
    """Who leads, and with what.

    who: a name for people, "" where that is nobody or unknown
    what: e.g. "look at 1 0 0.3", "neck_yaw at 17.2 deg", a gesture's name, why it was stopped
    joints: those that are held
    since_s: time of the rig since when; None where that is not known
    """

    kind: LeaderKind = "gaze"
    who: str = ""
    what: str = ""
    joints: tuple[str, ...] = ()
    since_s: float | None = None

    @property
    def led(self) -> bool:
        """Return whether something other than the gaze models moves the head or keeps it still."""
        return self.kind not in ("gaze", "gesture")


def leader_of(stopped: str, parking: bool, lead: LeadState, gesture: GestureState) -> Leader:
    """Return who leads.

    Args:
        stopped: why the robot was stopped, "" while it moves.
        parking: the run is over, and the head moves to its parking pose.
        lead: the newest lead.
        gesture: the newest gesture.
    """
    if stopped:
        return Leader("stopped", "", stopped)
    if parking:
        return Leader("parking")
    if lead.active:
        who = lead.who or "a client"
        return Leader(lead.by, who, lead.what, lead.joints, lead.since_s)
    if gesture.name:
        return Leader("gesture", gesture.who, gesture.name, (), gesture.since_s)
    return Leader()


def title(leader: Leader) -> str:
    """Return the leader in two or three words, e.g. "neck_yaw held", "stopped"."""
    match leader.kind:
        case "gaze":
            return "looks by itself"
        case "person":
            return f"led by {leader.who}"
        case "pointer":
            return "looks at the pointer"
        case "joint":
            return f"{' and '.join(leader.joints) or 'joints'} held"
        case "gesture":
            return leader.what
        case _:
            return leader.kind


def sentence(leader: Leader, t_s: float) -> str:
    """Return who leads in one sentence, e.g. "ann holds neck_yaw at 17.2 deg, for 3 s".

    Args:
        leader: who leads.
        t_s: now, on the rig's clock.
    """
    match leader.kind:
        case "gaze":
            return "nobody leads: it chooses by itself what to look at"
        case "person":
            said = f"{leader.who} makes it {leader.what}"
        case "pointer":
            said = f"it looks at the pointer of {leader.who}"
        case "joint":
            said = f"{leader.who} holds {leader.what}"
        case "gesture":
            said = f"it plays {leader.what}" + (f" for {leader.who}" if leader.who else "")
        case "stopped":
            return f"stopped: {leader.what}; the torque is off"
        case "parking":
            return "it moves to its parking pose, then the torque goes off"
        case "recording":
            return "a recording is shown: nothing here moves a rig"
    return said + _for(leader.since_s, t_s)


def _for(since_s: float | None, t_s: float) -> str:
    """Return how long it has lasted, "" where that is short or unknown."""
    lasted_s = t_s - since_s if since_s is not None else 0.0
    if lasted_s < _WORTH_TELLING_S:
        return ""
    if lasted_s < 2.0 * _MINUTE_S:
        return f", for {lasted_s:.0f} s"
    return f", for {lasted_s / _MINUTE_S:.0f} min"
