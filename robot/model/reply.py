"""What became of a command: refused, done, or done as far as the joints reach."""

import threading
from collections.abc import Callable, Mapping
from math import degrees, radians
from typing import Any, NamedTuple

from gazerig.gaze.angles import Vec3
from gazerig.robot.model.commands import Command

_BESIDE_DEG = 1.0
"""A gaze that rests nearer to its point than this looks there."""


class JointReply(NamedTuple):
    """One joint that was asked for something, in radians.

    low_rad, high_rad: the range in force
    reason: why ``done_rad`` is another angle than ``asked_rad``, "" where it is not
    """

    joint: str
    asked_rad: float
    done_rad: float
    low_rad: float
    high_rad: float
    reason: str

    def text(self) -> str:
        """Return one phrase for people."""
        if self.low_rad == self.high_rad:
            return f"{self.joint}: {self.reason}"
        if not self.reason:
            return f"{self.joint} to {degrees(self.done_rad):.1f} deg"
        return (
            f"{self.joint} stays at {degrees(self.done_rad):.1f} of {degrees(self.asked_rad):.1f} "
            f"deg ({self.reason}, {degrees(self.low_rad):g}..{degrees(self.high_rad):g})"
        )


class GestureReply(NamedTuple):
    """A gesture that was begun; name "": the one under way is ended.

    duration_s: until everything is at rest again
    slowed_by: factor by which it takes longer than asked; slow_joint: whose limits need that
    smaller: (joint, share of its motion that its range leaves)
    left_out: joints that it names and the rig lacks
    number: of the gesture (``gazerig.robot.model.lead.GestureState``)
    """

    name: str
    duration_s: float
    slowed_by: float = 1.0
    slow_joint: str = ""
    smaller: tuple[tuple[str, float], ...] = ()
    left_out: tuple[str, ...] = ()
    number: int = 0

    def text(self) -> str:
        """Return one line for people."""
        if not self.name:
            return f"gestures end within {self.duration_s:.2f} s"
        parts = [f"{self.name} takes {self.duration_s:.1f} s"]
        if self.slow_joint:
            parts.append(f"slower by {self.slowed_by:.2f} for {self.slow_joint}")
        parts += [f"{joint} moves {share:.0%} as far" for joint, share in self.smaller]
        if self.left_out:
            parts.append(f"without {', '.join(self.left_out)}")
        return "; ".join(parts)


class CommandReply(NamedTuple):
    """What the robot made of one command when it took it up.

    refused: why nothing was done, "" where something was
    asked_m: the point to look at; done_m: the point as far away that the eyes will rest on;
        None for other commands
    joints: those that cannot do what was asked; of a jog, all that were asked for
    error_rad: angle between the point and the line of sight once head and eyes are there, of
        the worse eye, or of their mean where one linkage turns both
    lead: number of the lead that it took (``gazerig.robot.model.lead.LeadState``), 0 for none
    gesture: what is played, None for other commands
    """

    refused: str = ""
    asked_m: Vec3 | None = None
    done_m: Vec3 | None = None
    joints: tuple[JointReply, ...] = ()
    error_rad: float = 0.0
    lead: int = 0
    gesture: GestureReply | None = None

    @property
    def error_deg(self) -> float:
        """Return ``error_rad`` in degrees."""
        return degrees(self.error_rad)

    @property
    def limited(self) -> tuple[JointReply, ...]:
        """Return the joints that cannot do what was asked."""
        return tuple(joint for joint in self.joints if joint.reason)

    def text(self) -> str:
        """Return one line for people, "" where there is nothing to say."""
        if self.refused:
            return f"refused: {self.refused}"
        if self.gesture is not None:
            return self.gesture.text()
        ends = "; ".join(joint.text() for joint in self.joints)
        if self.asked_m is None:
            return ends
        if self.error_deg < _BESIDE_DEG:
            return "it looks there"
        return f"it looks {self.error_deg:.0f} deg beside it" + (f": {ends}" if ends else "")

    def as_json(self) -> dict[str, object]:
        """Return plain JSON values: angles in degrees, metres, text."""
        text = self.text()
        return {
            "refused": self.refused,
            "asked_m": self.asked_m,
            "done_m": self.done_m,
            "error_deg": self.error_deg,
            "lead": self.lead,
            "joints": [
                {
                    "joint": one.joint,
                    "asked_deg": degrees(one.asked_rad),
                    "done_deg": degrees(one.done_rad),
                    "low_deg": degrees(one.low_rad),
                    "high_deg": degrees(one.high_rad),
                    "reason": one.reason,
                }
                for one in self.joints
            ],
            "gesture": None if self.gesture is None else self.gesture._asdict(),
            "text": text,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "CommandReply":
        """Return what ``as_json`` wrote.

        Raises:
            KeyError, TypeError, ValueError: the data is no reply.
        """
        joints = tuple(
            JointReply(
                one["joint"],
                radians(one["asked_deg"]),
                radians(one["done_deg"]),
                radians(one["low_deg"]),
                radians(one["high_deg"]),
                one["reason"],
            )
            for one in data["joints"]
        )
        asked, done = (_point(data[key]) for key in ("asked_m", "done_m"))
        error_rad = radians(data["error_deg"])
        return cls(
            data["refused"], asked, done, joints, error_rad, data.get("lead", 0), _gesture(data)
        )


def _gesture(data: Mapping[str, Any]) -> GestureReply | None:
    found = data.get("gesture")
    if found is None:
        return None
    smaller = tuple((joint, share) for joint, share in found["smaller"])
    return GestureReply(**{**found, "smaller": smaller, "left_out": tuple(found["left_out"])})


def _point(data: Any) -> Vec3 | None:
    if data is None:
        return None
    x, y, z = data
    return (x, y, z)


class Ticket:
    """Where the reply to one command comes; made by one thread, answered by the loop's."""

    def __init__(self) -> None:
        self._answered = threading.Event()
        self._reply = CommandReply()

    def answer(self, reply: CommandReply) -> None:
        """Leave the reply."""
        self._reply = reply
        self._answered.set()

    def wait(self, within_s: float) -> CommandReply | None:
        """Wait for the reply; None where the loop has not taken the command up in that time."""
        return self._reply if self._answered.wait(within_s) else None


CommandTaker = Callable[[Command], Ticket | None]
"""Takes a command for the next tick, as Robot.command does; None: there will be no reply."""
