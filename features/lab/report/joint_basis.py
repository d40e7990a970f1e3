"""The measures that a rig's joints permit, and whether they are measured or estimated."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from gazerig.features.lab.analysis.blink_finder import UPPER
from gazerig.features.lab.analysis.human_norms import GROUPS, LIDS, PARALLEL
from gazerig.robot.control.feedback_basis import Basis, basis_of
from gazerig.robot.model.types import order_joints


@dataclass(frozen=True)
class JointBasis:
    """The joints of a run.

    names: names in order; if empty, the joints are unknown and nothing is omitted
    estimated: joints whose servos have no feedback
    """

    names: tuple[str, ...] = ()
    estimated: tuple[str, ...] = ()

    def has_any(self, *names: str) -> bool:
        """Return whether the rig has any of some joints."""
        return not self.names or not frozenset(names).isdisjoint(self.names)

    @property
    def has_parallel_eyes(self) -> bool:
        """Return whether one linkage turns both eyes sideways."""
        return "eyes_pan" in self.names

    @property
    def styles(self) -> frozenset[str]:
        """Return the styles that select notes of the bands."""
        return frozenset((PARALLEL,)) if self.has_parallel_eyes else frozenset()

    def basis(self, group: str) -> Basis:
        """Return the basis of a section of the report: its lids, or eyes and neck."""
        lids = group == LIDS
        return basis_of(self.names, self.estimated, lambda name: name.endswith("_lid") == lids)

    @property
    def whole_basis(self) -> Basis:
        """Return the basis of the whole report."""
        each = {self.basis(group) for group in GROUPS if group != LIDS or self.has_any(*UPPER)}
        return each.pop() if len(each) == 1 else "partly estimated"

    def left_out(self, key: str) -> str:
        """Return why a measure or a figure needs other joints, "" if it does not."""
        return next((why for keys, cannot, why in _RULES if key in keys and cannot(self)), "")

    def all_left_out(self, keys: Iterable[str]) -> tuple[str, ...]:
        """Return the reasons for leaving out some of these measures and figures, each once."""
        return tuple(dict.fromkeys(why for key in keys if (why := self.left_out(key))))


_HEAD_PART = ("head_slope", "head_share", "head_after", "head_peak", "head_part")
_BLINKS = (
    "blink_rate", "blink_rate_talk", "blink_cv", "blink_close", "blink_hold", "blink_open",
    "blink_ratio", "evoked", "blink_partial", "blink_tied", "blink_shape", "blink_when",
)  # fmt: skip


_RULES: tuple[tuple[Sequence[str], Callable[[JointBasis], bool], str], ...] = (
    (
        (*_HEAD_PART, "head_roll", "vor"),
        lambda joints: not joints.has_any("neck_yaw", "neck_pitch", "neck_roll"),
        "This rig has no neck, so it has no head movement.",
    ),
    (
        _HEAD_PART,
        lambda joints: not joints.has_any("neck_yaw"),
        "No joint turns the head sideways: the head's part in gaze shifts is left out.",
    ),
    (
        ("head_roll",),
        lambda joints: not joints.has_any("neck_roll"),
        "No joint rolls the head.",
    ),
    (
        ("vor",),
        lambda joints: not joints.has_any("neck_yaw", "neck_pitch"),
        "No joint turns the head sideways or up, so the gaze need not be stabilised.",
    ),
    (
        ("vergence", "vergence_ok"),
        lambda joints: joints.has_parallel_eyes,
        "One linkage turns both eyes sideways: they stay parallel, and there is no vergence.",
    ),
    (
        _BLINKS,
        lambda joints: not joints.has_any(*UPPER),
        "This rig has no upper lids, so it has no blinks.",
    ),
    (
        ("unasked",),
        lambda joints: (
            any("eye" in name for name in joints.estimated)
            and all(name in joints.estimated for name in joints.names if "eye" in name)
        ),
        "Saccades without a command are left out: an estimated eye follows its command, whatever "
        "the real eye does.",
    ),
)


def joints_of(names: Iterable[str], estimated: Iterable[str]) -> JointBasis:
    """Return the basis from the joints of ticks."""
    return JointBasis(order_joints(names), order_joints(estimated))
