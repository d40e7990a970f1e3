"""Zero, sign and range of a joint, computed from servo positions. Pure.

A servo counts 4096 steps per turn; the transition from 4095 to 0 is its seam. After a restart it
knows only the position within the turn, so a joint whose travel contains the seam could be wrong by
a whole turn. Such a joint cannot be used, and its servo must be mounted again. Steps as in
gazerig.drivers.bus.servo_models, angles in degrees at the joint.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import floor
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import STEPS_PER_TURN
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.types import GAZE_JOINTS

SMALLEST_RANGE_DEG = 5.0
"""Least motion of a joint that counts as turned."""

LONGEST_GAP_S = 0.3
MAX_UNSEEN_JUMP_STEPS = STEPS_PER_TURN // 8
"""Longest gap and largest motion between two samples with a certain direction."""

ENDS = {
    "eye_pan": ("LEFT", "RIGHT"),
    "eye_tilt": ("UPPER", "LOWER"),
    "eyes_pan": ("LEFT", "RIGHT"),
    "eyes_tilt": ("UPPER", "LOWER"),
    "upper_lid": ("OPEN", "SHUT"),
    "lower_lid": ("OPEN", "SHUT"),
    "neck_yaw": ("LEFT", "RIGHT"),
    "neck_pitch": ("UPPER", "LOWER"),
    "neck_roll": ("RIGHT EAR DOWN", "LEFT EAR DOWN"),
}
"""Names of the ends of a joint, the positive one first (signs as in gaze.types)."""


class CalibrationRefused(SetupError):
    """Refusal of a joint calibration; the message has the reason and the remedy."""


class Marks(NamedTuple):
    """Positions of a joint at its marks, in unwrapped steps.

    positive_end: left, upper, open, or right ear down
    zero: straight ahead; a lid half open
    """

    positive_end: int
    negative_end: int
    zero: int


class Calibration(NamedTuple):
    """Calibrated values of one joint for the rig file; the fields are those of JointParams."""

    zero_step: int
    sign: int
    min_deg: float
    max_deg: float


class LinkageFit(NamedTuple):
    """Calibrated values of a joint with a push rod; the fields are those of JointParams.

    transmission_points: (joint angle in degrees, servo position in steps or us), rising angles
    """

    transmission_points: tuple[tuple[float, float], ...]
    min_deg: float
    max_deg: float


class PositionUnwrapper:
    """Follows a position register over the seam.

    Some firmware continues to count above 4095, some restarts at 0. A change is interpreted as the
    shorter turn, so both give the same result.
    """

    def __init__(self) -> None:
        self._at: int | None = None
        self._seen_s = 0.0

    def see(self, position_steps: int, t_s: float) -> int:
        """Add one sample; return the unwrapped position.

        Raises:
            CalibrationRefused: it moved too far between two samples to determine its direction.
        """
        if self._at is None:
            self._at = position_steps % STEPS_PER_TURN
        else:
            half = STEPS_PER_TURN // 2
            change = (position_steps - self._at + half) % STEPS_PER_TURN - half
            gap_s = t_s - self._seen_s
            if gap_s > LONGEST_GAP_S and abs(change) > MAX_UNSEEN_JUMP_STEPS:
                raise CalibrationRefused(
                    f"it turned by {abs(change) * 360 / STEPS_PER_TURN:.0f} deg while the servo "
                    f"did not answer for {gap_s:.1f} s: check its cable, and start again"
                )
            self._at += change
        self._seen_s = t_s
        return self._at


def end_names(joint_name: str) -> tuple[str, str]:
    """Return the names of a joint's positive and negative end."""
    if joint_name not in GAZE_JOINTS:
        return "POSITIVE", "NEGATIVE"
    return next(ends for part, ends in ENDS.items() if joint_name.endswith(part))


def zero_name(joint_name: str) -> str:
    """Return the common name of the position of a joint at 0 deg."""
    return "straight ahead" if joint_name in GAZE_JOINTS else "at rest"


def is_lid(joint_name: str) -> bool:
    """Return whether a joint moves a lid, which has two ends but no "straight ahead"."""
    return joint_name in LIDS


def centre_zero(marks: Marks) -> Marks:
    """Set the zero in the middle between the ends."""
    return marks._replace(zero=(marks.positive_end + marks.negative_end) // 2)


def joint_calibration(
    name: str, marks: Marks, joint: JointParams, margin_deg: float
) -> Calibration:
    """Return zero, sign and range of a joint, ``margin_deg`` short of each end.

    joint: present configuration; its gear ratio is assumed to be correct

    Raises:
        CalibrationRefused: the range is too small, excludes zero or contains the seam.
    """
    steps_per_deg = joint.ratio * STEPS_PER_TURN / 360.0
    low, high = sorted((marks.positive_end, marks.negative_end))
    ends = f"steps {low % STEPS_PER_TURN} to {high % STEPS_PER_TURN}"
    if (high - low) / steps_per_deg <= SMALLEST_RANGE_DEG:
        raise CalibrationRefused(
            f"{name}: only {(high - low) / steps_per_deg:.1f} deg are between the two ends, more "
            f"than {SMALLEST_RANGE_DEG:g} are needed: is this the joint that was turned, and is "
            "its horn screwed on?"
        )
    if high - low >= STEPS_PER_TURN - 1:
        raise CalibrationRefused(
            f"{name}: it turns {(high - low) / steps_per_deg:.0f} deg, and its servo counts only "
            "one turn: give the joint stops, or check its ratio"
        )
    # A restarted servo counts in the turn 0..4095.
    if low // STEPS_PER_TURN != high // STEPS_PER_TURN:
        off = STEPS_PER_TURN // 2 - (low + high) // 2 % STEPS_PER_TURN
        remedy = (
            "calibrate again with --set-middle, and the servo calls the middle of the travel 2048"
            if servo_kind(joint.model).set_middle is not None
            else "take the horn off, hold the joint in the middle of its travel, turn the servo's "
            f"shaft by {abs(off) * 360 / STEPS_PER_TURN:.0f} deg towards "
            f"{'more' if off > 0 else 'fewer'} steps (about 2048), put the horn on again, and "
            "calibrate again. A Homing Offset is no cure: in position mode some firmware loses it "
            "by a turn as the torque comes on"
        )
        raise CalibrationRefused(
            f"{name}: its travel ({ends}) crosses the servo's seam from 4095 to 0, where a "
            f"restarted servo is a whole turn wrong: {remedy}"
        )
    zero = marks.zero
    if name not in GAZE_JOINTS and low - steps_per_deg <= zero <= high + steps_per_deg:
        zero = min(max(zero, low), high)  # a jaw rests shut, at one of its ends
    if not low <= zero <= high:
        raise CalibrationRefused(
            f"{name}: {zero_name(name)} (step {zero % STEPS_PER_TURN}) is not between the ends "
            f"({ends}): mark the three places again"
        )
    most, least = (abs(end - zero) / steps_per_deg for end in marks[:2])
    sign = 1 if marks.positive_end > marks.negative_end else -1
    made = Calibration(zero % STEPS_PER_TURN, sign, *range_within(name, -least, most, margin_deg))
    with_calibration(name, joint, made)
    return made


def range_within(
    name: str, low_deg: float, high_deg: float, margin_deg: float
) -> tuple[float, float]:
    """Return a joint's range short of its ends; the end at which a jaw rests stays 0.

    Raises:
        CalibrationRefused: it excludes 0, or is too small or too large.
    """
    low, high = (round_inwards(end - margin_deg) for end in (-low_deg, high_deg))
    if name not in GAZE_JOINTS and low_deg <= 0.0 <= high_deg:
        low, high = max(low, 0.0), max(high, 0.0)
    if low < 0.0 or high < 0.0:
        raise CalibrationRefused(
            f"{name}: its range of {-low:g}..{high:g} deg, {margin_deg:g} deg short of its ends, "
            f"does not include {zero_name(name)}, which is 0 deg (of a lid half open): lessen the "
            "margin, or build the horn in again"
        )
    if not SMALLEST_RANGE_DEG < low + high <= 360.0 or max(low, high) > 180.0:
        raise CalibrationRefused(
            f"{name}: {low + high:.1f} deg are left between its ends, more than "
            f"{SMALLEST_RANGE_DEG:g} and at most 180 to each side are possible: mark them farther "
            "apart, lessen the margin, or check its ratio"
        )
    return 0.0 - low, high


def round_inwards(angle_deg: float) -> float:
    """Round down to tenths, so that the range is never larger than measured."""
    return floor(angle_deg * 10.0 + 1e-6) / 10.0


def with_calibration(name: str, joint: JointParams, made: Calibration | LinkageFit) -> JointParams:
    """Return the joint with its calibration.

    Raises:
        CalibrationRefused: the rules of the joint refuse it.
    """
    try:
        return replace(joint, **made._asdict())
    except ValueError as error:
        raise CalibrationRefused(f"{name}: {error}: calibrate again") from error


def rig_changes(
    name: str, joint: JointParams, made: Calibration | LinkageFit, park_deg: Mapping[str, float]
) -> dict[str, object]:
    """Return dotted keys of the rig file and their new values, only those that differ.

    Values that depend on the old range also change: a lid's shut and open angles are set to its
    ends, a parking angle outside the new range to the nearer end.
    """
    wanted: dict[str, object] = {
        f"joints.{name}.{key}": value
        for key, value in made._asdict().items()
        if getattr(joint, key) != value
    }
    if is_lid(name):
        key = name.removesuffix("_lid").removesuffix("_upper")
        wanted[f"lid_joints.{key}_deg"] = made.min_deg, made.max_deg
    parked = park_deg.get(name)
    if parked is not None and not made.min_deg <= parked <= made.max_deg:
        wanted[f"park_deg.{name}"] = made.min_deg if parked < made.min_deg else made.max_deg
    return wanted
