"""What a rig's joints allow to be said of its gaze, and what that rests on."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from gazerig.robot.analysis.lid_opening import UPPER
from gazerig.robot.analysis.norm_bands import GROUPS, LIDS, PARALLEL
from gazerig.robot.control.feedback_basis import Basis, basis_of
from gazerig.robot.model.types import in_order


@dataclass(frozen=True)
class JointBasis:
    """The joints of a run.

    names: in their order; empty if unknown, and then nothing is left out
    estimated: those whose servos tell nothing
    """

    names: tuple[str, ...] = ()
    estimated: tuple[str, ...] = ()

    def has(self, *names: str) -> bool:
        """Return whether any of some joints is there."""
        return not self.names or not frozenset(names).isdisjoint(self.names)

    @property
    def parallel(self) -> bool:
        """Return whether one linkage turns both eyes sideways."""
        return "eyes_pan" in self.names

    @property
    def styles(self) -> frozenset[str]:
        """Return which notes of the bands apply."""
        return frozenset((PARALLEL,)) if self.parallel else frozenset()

    def basis(self, group: str) -> Basis:
        """Return what a section of the report rests on: its lids, or eyes and neck."""
        lids = group == LIDS
        return basis_of(self.names, self.estimated, lambda name: name.endswith("_lid") == lids)

    @property
    def whole_basis(self) -> Basis:
        """Return what the whole report rests on."""
        each = {self.basis(group) for group in GROUPS if group != LIDS or self.has(*UPPER)}
        return each.pop() if len(each) == 1 else "partly estimated"

    def left_out(self, key: str) -> str:
        """Return why a measure or a figure can say nothing of these joints, "" where it can."""
        return next((why for keys, cannot, why in _RULES if key in keys and cannot(self)), "")

    def all_left_out(self, keys: Iterable[str]) -> tuple[str, ...]:
        """Return why some of these measures and figures are left out, each reason once."""
        return tuple(dict.fromkeys(why for key in keys if (why := self.left_out(key))))


_HEAD_PART = ("head_slope", "head_share", "head_after", "head_peak", "head_part")
_BLINKS = (
    "blink_rate", "blink_rate_talk", "blink_cv", "blink_close", "blink_hold", "blink_open",
    "blink_ratio", "evoked", "blink_partial", "blink_tied", "blink_shape", "blink_when",
)  # fmt: skip


def _no_neck(joints: JointBasis) -> bool:
    return not joints.has("neck_yaw", "neck_pitch", "neck_roll")


def _eyes_estimated(joints: JointBasis) -> bool:
    return any("eye" in name for name in joints.estimated) and all(
        name in joints.estimated for name in joints.names if "eye" in name
    )


_RULES: tuple[tuple[Sequence[str], Callable[[JointBasis], bool], str], ...] = (
    (
        (*_HEAD_PART, "head_roll", "vor"),
        _no_neck,
        "This rig has no neck: there is no head movement to look at.",
    ),
    (
        _HEAD_PART,
        lambda joints: not joints.has("neck_yaw"),
        "No joint turns the head sideways: its part in shifts of the gaze is left out.",
    ),
    (
        ("head_roll",),
        lambda joints: not joints.has("neck_roll"),
        "No joint rolls the head.",
    ),
    (
        ("vor",),
        lambda joints: not joints.has("neck_yaw", "neck_pitch"),
        "No joint turns the head sideways or up: there is no turn to hold the gaze in.",
    ),
    (
        ("vergence", "vergence_ok"),
        lambda joints: joints.parallel,
        "One linkage turns both eyes sideways: they stay parallel, and there is no vergence.",
    ),
    (
        _BLINKS,
        lambda joints: not joints.has(*UPPER),
        "This rig has no upper lids: there are no blinks to look at.",
    ),
    (
        ("unasked",),
        _eyes_estimated,
        "Saccades that no model asked for are left out: an estimated eye follows its command, whatever "
        "the real one does.",
    ),
)


def joints_of(names: Iterable[str], estimated: Iterable[str]) -> JointBasis:
    """Gather what ticks say of their joints."""
    return JointBasis(in_order(names), in_order(estimated))
