"""What a rig's joints allow to be said of its gaze, and what that rests on."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isnan, nan

from robot.reckoned import Basis, basis_of
from robot.report.bands import FACE, FOLLOWING, GROUPS, HEAD, LIDS, SACCADES, SOCIAL
from robot.types import in_order

UPPER = ("left_upper_lid", "right_upper_lid")
LOWER = ("left_lower_lid", "right_lower_lid")

_OF_THE_HEAD = ("head_slope", "head_share", "head_after", "head_peak", "head_part")
_OF_VERGENCE = ("vergence", "vergence_ok")
_OF_BLINKS = (
    "blink_rate", "blink_rate_talk", "blink_cv", "blink_close", "blink_hold", "blink_open",
    "blink_ratio", "evoked", "blink_shape", "blink_when",
)  # fmt: skip
_WORDS = {
    "no neck": "the rig has no neck: there is no head movement to look at",
    "no yaw": "no joint turns the head sideways: its part in shifts of the gaze cannot be told",
    "no turn": "no joint turns the head sideways or up: there is no turn to hold the gaze in",
    "parallel": "one linkage turns both eyes sideways: they stay parallel, and vergence cannot be",
    "no lids": "the rig has no upper lids: there are no blinks to look at",
    "cannot swing": "saccades that nobody asked for: what servos do beyond their commands is not "
    "seen where the eyes are reckoned",
}
PARALLEL = "eyes parallel"
"""Style of a run whose eyes cannot converge, for notes of the bands."""


@dataclass(frozen=True)
class RunJoints:
    """The joints of a run.

    names: in their order; empty where nobody says, and then nothing is left out
    reckoned: those whose servos tell nothing
    """

    names: tuple[str, ...] = ()
    reckoned: tuple[str, ...] = ()

    def has(self, *names: str) -> bool:
        """Tell whether any of some joints is there."""
        return not self.names or not frozenset(names).isdisjoint(self.names)

    @property
    def parallel(self) -> bool:
        """Tell whether one linkage turns both eyes sideways."""
        return "eyes_pan" in self.names

    @property
    def styles(self) -> frozenset[str]:
        """Give which notes of the bands apply."""
        return frozenset((PARALLEL,)) if self.parallel else frozenset()

    def basis(self, group: str) -> Basis:
        """Tell what the figures of a section of the report rest on."""
        lids = group == LIDS
        return basis_of(self.names, self.reckoned, lambda name: name.endswith("lid") == lids)

    @property
    def whole_basis(self) -> Basis:
        """Tell what all figures together rest on."""
        each = {self.basis(group) for group in self._groups()}
        return each.pop() if len(each) == 1 else "partly reckoned"

    def left_out(self, key: str) -> str:
        """Give why a measure or a figure says nothing of these joints, "" where it does."""
        why = ""
        if key in _OF_VERGENCE and self.parallel:
            why = "parallel"
        elif key in _OF_BLINKS and not self.has(*UPPER):
            why = "no lids"
        elif key in (*_OF_HEAD_TURNS, *_OF_THE_HEAD):
            why = self._lacks_of_neck(key)
        elif key == "unasked" and self.basis(SACCADES) == "reckoned":
            why = "cannot swing"
        return _WORDS[why] if why else ""

    def _lacks_of_neck(self, key: str) -> str:
        if not self.has("neck_yaw", "neck_pitch", "neck_roll"):
            return "no neck"
        if key in _OF_THE_HEAD:
            return "" if self.has("neck_yaw") else "no yaw"
        return "" if self.has("neck_yaw", "neck_pitch") else "no turn"

    def _groups(self) -> Iterable[str]:
        """Give the sections that say anything."""
        return (g for g in GROUPS if g != LIDS or self.has(*UPPER))


_OF_HEAD_TURNS = ("vor",)


def joints_of(names: Iterable[str], reckoned: Iterable[str]) -> RunJoints:
    """Gather what ticks say of their joints."""
    return RunJoints(in_order(names), in_order(reckoned))


def opening(left: float, right: float, joints: tuple[str, ...], pair: tuple[str, str]) -> float:
    """Give the opening of the wider of two lids, of those that are there; nan without any.

    pair: names of the left and the right one
    """
    if not joints:
        return max(left, right)
    there = [o for name, o in zip(pair, (left, right), strict=True) if name in joints]
    return max(there, default=nan)


def seen(openings: float) -> bool:
    """Tell whether there is a lid."""
    return not isnan(openings)


__all__ = ["FACE", "FOLLOWING", "HEAD", "SOCIAL"]
