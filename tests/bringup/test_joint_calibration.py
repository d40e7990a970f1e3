"""Zero, sign and range from servo positions, anywhere on the encoder, with and without its seam."""

from dataclasses import replace
from math import radians
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.rig import LidJoints
from gazerig.config.schema import load_rig
from gazerig.features.bringup.calibration.endstop_search import (
    STEPS_PER_DEG,
    EndStop,
    StopSearch,
    StopSearchParams,
    go,
    search,
)
from gazerig.features.bringup.calibration.joint_calibration import (
    Calibration,
    CalibrationRefused,
    Marks,
    PositionUnwrapper,
    calibration,
    centre_zero,
    changes,
    ends_of,
    is_lid,
    lid_keys,
    with_calibration,
)
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS as EVERY

JOINT = JointParams(1, "xl330-m077", -35.0, 35.0, 600.0, 45000.0)
TURN = 4096


# --- following a position over the seam


@given(
    start=st.integers(0, TURN - 1),
    moves=st.lists(st.integers(-1500, 1500), max_size=60),
    wraps=st.booleans(),
)
def test_a_position_is_followed_over_the_seam_however_it_is_reported(
    start: int, moves: list[int], wraps: bool
) -> None:
    track, true = PositionUnwrapper(), start
    assert track.see(start, 0.0) == start
    for i, move in enumerate(moves, 1):
        true += move
        reported = true % TURN if wraps else true
        assert track.see(reported, i * 0.05) == true
    assert track.steps == true


def test_a_servo_that_went_on_counting_before_is_taken_into_its_turn() -> None:
    assert PositionUnwrapper().see(TURN + 100, 0.0) == 100
    assert PositionUnwrapper().see(-100, 0.0) == TURN - 100


def test_turning_unseen_is_refused_when_its_way_is_unknown() -> None:
    track = PositionUnwrapper()
    track.see(1000, 0.0)
    assert track.see(1400, 2.0) == 1400
    with pytest.raises(CalibrationRefused, match=r"turned by 97 deg .* for 1.0 s"):
        track.see(2500, 3.0)


# --- marks to a calibration


@given(
    zero=st.integers(0, TURN - 1),
    sign=st.sampled_from([1, -1]),
    plus_deg=st.floats(3.0, 170.0),
    minus_deg=st.floats(3.0, 170.0),
    margin=st.floats(0.0, 3.0),
    ratio=st.sampled_from([0.5, 1.0, 2.5]),
    turn=st.integers(-2, 2),
)
def test_what_is_found_is_what_is_there_or_it_is_refused(
    zero: int, sign: int, plus_deg: float, minus_deg: float, margin: float, ratio: float, turn: int
) -> None:
    joint = replace(JOINT, ratio=ratio, min_deg=-1.0, max_deg=1.0)
    scale = sign * ratio * STEPS_PER_DEG
    # Turned before by hand by whole turns: that must not matter.
    place = zero + turn * TURN
    marks = Marks(round(place + scale * plus_deg), round(place - scale * minus_deg), place)
    ends = [end - turn * TURN for end in marks[:2]]
    inside = all(0 <= end < TURN for end in ends)
    try:
        found = calibration("left_eye_pan", marks, joint, margin)
    except CalibrationRefused as refused:
        roomy = plus_deg > margin + 0.2 and minus_deg > margin + 0.2
        wide = plus_deg + minus_deg - 2.0 * margin > 5.5
        assert not (inside and roomy and wide), refused
        return
    assert inside
    assert found.zero_step == zero and found.sign == sign
    made = with_calibration(joint, found)
    for angle, end in ((found.max_deg, ends[0]), (found.min_deg, ends[1])):
        short_steps = (end - made.steps(radians(angle))) * (1 if angle > 0 else -1) * sign
        assert margin <= short_steps / (ratio * STEPS_PER_DEG) + 0.1 / ratio
        assert short_steps / (ratio * STEPS_PER_DEG) < margin + 0.1 + 0.2 / ratio


@given(span=st.integers(100, 4000), below=st.floats(0.0, 1.0), at=st.floats(0.1, 0.9))
def test_a_travel_with_the_seam_in_it_is_always_refused_with_the_cure(
    span: int, below: float, at: float
) -> None:
    start = TURN - 1 - int(below * (span - 1))
    marks = Marks(start + span, start, start + round(at * span))
    with pytest.raises(CalibrationRefused, match="seam") as refused:
        calibration("neck_yaw", marks, JOINT, 0.0)
    words = str(refused.value).split()
    turn_deg = float(words[words.index("by") + 1])
    more = "towards more steps" in str(refused.value)
    reseated = (start + span // 2) % TURN + (1 if more else -1) * turn_deg * STEPS_PER_DEG
    assert abs(reseated - 2048) < 8.0  # told in whole degrees


@pytest.mark.parametrize(
    ("marks", "says"),
    [
        (Marks(2070, 2030, 2050), "only 3.5 deg are between the two ends"),
        (Marks(2300, 1800, 2400), "is not between the ends"),
        (Marks(2300, 1800, 2290), "is within 2 deg of an end"),
        (Marks(2085, 2011, 2048), "with 2 deg of margin at each end only"),
        (Marks(2000 + 5000, 2000, 4000), "counts only one turn"),
    ],
)
def test_marks_that_make_no_calibration_are_refused_in_words(marks: Marks, says: str) -> None:
    with pytest.raises(CalibrationRefused, match=says):
        calibration("left_eye_pan", marks, JOINT, 2.0)


def test_a_geared_joint_beyond_half_a_turn_is_refused() -> None:
    geared = replace(JOINT, ratio=0.1, min_deg=-1.0, max_deg=1.0)
    with pytest.raises(CalibrationRefused, match="more than a joint may turn"):
        calibration("neck_yaw", Marks(2600, 1500, 2048), geared, 2.0)


def test_every_joint_has_names_for_its_ends() -> None:
    for name in EVERY:
        positive, negative = ends_of(name)
        assert positive != negative
    assert ends_of("right_eye_tilt") == ends_of("eyes_tilt") == ("UPPER", "LOWER")
    assert ends_of("left_lower_lid") == ("OPEN", "SHUT")


def test_the_keys_of_lids_are_those_of_the_rig_file() -> None:
    lids = [name for name in EVERY if is_lid(name)]
    assert len(lids) == 4 and all(lid_keys(name) == LidJoints.keys(name) for name in lids)


def test_the_cure_for_the_seam_is_what_the_servo_can_do() -> None:
    sts = replace(JOINT, model="sts3215")
    with pytest.raises(CalibrationRefused, match="--set-middle"):
        calibration("neck_yaw", Marks(4200, 3900, 4050), sts, 0.0)
    with pytest.raises(CalibrationRefused, match="take the horn off"):
        calibration("neck_yaw", Marks(4200, 3900, 4050), JOINT, 0.0)


# --- what goes into the rig file


def test_only_what_differs_is_changed() -> None:
    found = Calibration(cast(int, JOINT.zero_step), 1, -35.0, 30.0)
    assert changes("left_eye_pan", JOINT, found, {}) == {"joints.left_eye_pan.max_deg": 30.0}


@pytest.mark.parametrize(("lid", "key"), [("upper", "left"), ("lower", "left_lower")])
def test_a_lid_s_own_ends_and_its_parking_follow_the_new_range(lid: str, key: str) -> None:
    name, found = f"left_{lid}_lid", Calibration(2000, -1, -20.0, 22.0)
    wanted = changes(name, JOINT, found, {name: -25.0, "neck_pitch": -12.0})
    ends = {f"lid_joints.{key}_shut_deg": -20.0, f"lid_joints.{key}_open_deg": 22.0}
    assert {one: wanted[one] for one in wanted if one.startswith("lid_joints")} == ends
    assert wanted[f"park_deg.{name}"] == -20.0 and "park_deg.neck_pitch" not in wanted


def test_the_middle_is_half_way() -> None:
    assert centre_zero(Marks(3000, 1000, 0)).zero == 2000


# --- finding a stop

PARAMS = StopSearchParams()


class Toy:
    """A joint that follows its goal with a lag, between two stops, perhaps with a finger in it."""

    def __init__(self, at: float, low: float, high: float, friction_steps: float = 7.0) -> None:
        self.x, self.low, self.high = at, low, high
        self.friction = friction_steps
        self.goal: float | None = None
        self.t_s = 0.0
        self.pushed_s = self.longest_push_s = 0.0

    def exchange(self, goal: int | None) -> tuple[int, float, float]:
        self.goal = goal if goal is not None else self.goal
        self.t_s += 0.02
        error = 0.0 if self.goal is None else self.goal - self.x
        before = self.x
        if abs(error) > self.friction:
            self.x += 0.5 * (error - (self.friction if error > 0 else -self.friction))
        self.x = min(max(self.x, self.low), self.high)
        stuck = abs(error) > 20.0 and self.x == before
        self.pushed_s = self.pushed_s + 0.02 if stuck else 0.0
        self.longest_push_s = max(self.longest_push_s, self.pushed_s)
        # A position servo pushes with its error; a share of the stall current.
        load = max(-PARAMS.strength, min(PARAMS.strength, error * 3.1 / 885.0)) if stuck else 0.0
        return round(self.x), load, self.t_s


@given(
    at=st.floats(0.0, 1.0),
    low=st.integers(100, 1900),
    span=st.integers(150, 2000),
    way=st.sampled_from([1, -1]),
    friction=st.floats(0.0, 12.0),
)
def test_a_stop_is_found_where_it_is_and_never_pushed_for_half_a_second(
    at: float, low: int, span: int, way: int, friction: float
) -> None:
    toy = Toy(low + at * span, low, low + span, friction)
    found = search(PARAMS, way, (0, TURN - 1), toy.exchange)
    end = low + span if way > 0 else low
    assert found.kind == "stop"
    assert abs(found.position_steps - end) <= 2
    assert toy.longest_push_s <= 0.5
    back = (end - toy.x) * way / STEPS_PER_DEG
    assert 1.5 <= back <= PARAMS.back_off_deg + 0.1


def test_the_goal_never_runs_far_ahead_nor_fast() -> None:
    look = StopSearch(PARAMS, 1, 0, TURN - 1)
    goals = [look.step(2048, 0.0, 0.02 * i) for i in range(20)]
    assert max(goals) - 2048 <= PARAMS.lead_deg * STEPS_PER_DEG
    steps = [after - before for before, after in zip(goals, goals[1:], strict=False)]
    assert max(steps) <= PARAMS.speed_deg_s * 0.02 * STEPS_PER_DEG + 1


def test_current_without_motion_ends_a_push_early() -> None:
    gentle = Toy(1000, 0, 1000, 0.0)
    strong = search(PARAMS, 1, (0, TURN - 1), gentle.exchange)
    assert strong.pushed_s < PARAMS.longest_push_ms / 1e3
    blind = Toy(1000, 0, 1000, 0.0)
    late = search(
        PARAMS, 1, (0, TURN - 1), lambda goal: (*blind.exchange(goal)[:1], 0.0, blind.t_s)
    )
    assert late.kind == "stop" and strong.pushed_s < late.pushed_s <= 0.5


def test_the_end_of_the_turn_is_no_stop() -> None:
    free = Toy(3900, -5000, 9000)
    assert search(PARAMS, 1, (0, TURN - 1), free.exchange).kind == "limit"
    assert isinstance(search(PARAMS, -1, (3000, TURN - 1), free.exchange), EndStop)


def test_going_somewhere_tells_whether_something_was_in_the_way() -> None:
    toy = Toy(1000, 500, 2000)
    assert go(1800, PARAMS, toy.exchange)
    assert abs(toy.x - 1800) < 1.5 * STEPS_PER_DEG
    assert not go(2500, PARAMS, toy.exchange)
    assert toy.longest_push_s <= 0.5


def test_a_jaw_may_rest_at_its_stop_and_an_eye_may_not() -> None:
    joint = load_rig("expressive").joints["jaw"]
    assert ends_of("jaw") == ends_of("car_lid") == ("POSITIVE", "NEGATIVE")
    made = calibration("jaw", Marks(2400, 2047, 2045), joint, 2.0)
    assert (made.zero_step, made.min_deg, made.sign) == (2047, 0.0, 1)
    assert made.max_deg == pytest.approx(29.0, abs=0.05)
    with pytest.raises(CalibrationRefused, match=r"straight ahead .* is not between"):
        calibration("neck_yaw", Marks(2400, 2047, 2045), joint, 2.0)
