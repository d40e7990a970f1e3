"""What --set takes, what is refused before anything runs, and the points that come of it."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.load import ConfigError
from gazerig.config.parameters import changed
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.sweep.axes import Axis, axes_of, check_points, grid, latin_hypercube
from gazerig.robot.cli.tune import read_value

RIG = load_rig("desk")
COMFORT, BLINKS = "gaze.head.comfort_deg", "gaze.lids.blinks_per_min"
LOW, HIGH = "gaze.head.min_salience", "gaze.head.max_salience"


def read(*settings: str) -> list[Axis]:
    return axes_of(RIG, settings, read_value)


def test_steps_lists_and_ranges_are_read() -> None:
    steps, words, flags, reach = read(
        f"{COMFORT}=4:16:7",
        "gaze.saccade.profile=min_jerk, main_sequence",
        "gaze.head.literal_reach=true,false",
        f"{BLINKS}=8..30.5",
    )
    assert steps.values == (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0) and steps.unit == "deg"
    assert words.values == ("min_jerk", "main_sequence") and flags.values == (True, False)
    assert reach.is_range and (reach.low, reach.high, reach.whole) == (8.0, 30.5, False)
    assert reach.label == f"{BLINKS}, 1/min" and words.label == "gaze.saccade.profile"


def test_lists_can_be_levels() -> None:
    (axis,) = read("joints.neck_yaw.gains=[400, 0, 0],[800, 0, 0]")
    assert axis.values == ((400, 0, 0), (800, 0, 0))


def test_whole_numbers_stay_whole() -> None:
    (axis,) = read("webcam.width_px=640:1280:3")
    assert axis.values == (640, 960, 1280) and all(isinstance(v, int) for v in axis.values)
    with pytest.raises(SetupError, match="640.5 is no whole number"):
        read("webcam.width_px=640:641:3")
    with pytest.raises(ConfigError, match="640.5 has a fraction|wanted a whole number"):
        read("webcam.width_px=640.5:700")


@pytest.mark.parametrize(
    ("setting", "error", "text"),
    [
        ("gaze.head.comfrt_deg=4:16:7", ConfigError, "unknown key 'comfrt_deg'; did you mean"),
        (f"{COMFORT}=4:160", ConfigError, "160.0 is above 90 (unit deg)"),
        (
            "gaze.saccade.profile=1:3:3",
            SetupError,
            "profile=human,main_sequence,min_jerk,literal_frame",
        ),
        (f"{COMFORT}", SetupError, "not KEY=VALUES; values are LOW:HIGH:STEPS"),
        (f"{COMFORT}=", SetupError, "not KEY=VALUES"),
        (f"{COMFORT}=9:4:3", SetupError, "9 is not below 4"),
        (f"{COMFORT}=4:9:1", SetupError, "1 steps; wanted 2 to"),
        (f"{COMFORT}=4,5,4", SetupError, "a value is given twice"),
        (f"{COMFORT}=[4", SetupError, "not valid YAML"),
        ("gaze.head=4:9:2", SetupError, "is no single value; name one, for example gaze.head."),
        ("profile=robot,mitake", SetupError, "it acts while files are read; give --profile"),
    ],
)
def test_what_cannot_be_a_setting_is_refused(
    setting: str, error: type[Exception], text: str
) -> None:
    with pytest.raises(error) as refused:
        read(setting)
    assert text in str(refused.value)


def test_a_key_stands_once_and_all_faults_are_told() -> None:
    with pytest.raises(SetupError, match="is given twice"):
        read(f"{COMFORT}=4,5", f"{COMFORT}=6,7")
    with pytest.raises(ConfigError) as refused:
        read("gaze.hed.comfort_deg=4,5", f"{BLINKS}=1:99")
    assert "did you mean 'head'" in str(refused.value) and "above 60" in str(refused.value)


def test_a_grid_has_every_combination_the_last_axis_fastest() -> None:
    points = grid(read(f"{COMFORT}=4,6", f"{BLINKS}=10:30:3"))
    assert [tuple(point.values()) for point in points] == [
        (4, 10.0), (4, 20.0), (4, 30.0), (6, 10.0), (6, 20.0), (6, 30.0)
    ]  # fmt: skip
    with pytest.raises(SetupError, match="needs --samples N or --fit; for a grid write .*:STEPS"):
        grid(read(f"{COMFORT}=4:16"))
    with pytest.raises(SetupError, match="at most 100000"):
        grid(read(f"{COMFORT}=4:16:1000", f"{BLINKS}=1:60:1000"))


def test_values_that_the_rig_allows_nowhere_are_refused_before_anything_runs() -> None:
    axes = read(f"{COMFORT}=4,x,-3,95", f"{BLINKS}=10,20")
    with pytest.raises(ConfigError) as refused:
        check_points(RIG, axes, grid(axes))
    assert str(refused.value).splitlines() == [
        f"{COMFORT}: 'x' is text, wanted a number, 0 to 90 deg",
        f"{COMFORT}: -3 is below 0 (unit deg)",
        f"{COMFORT}: 95 is above 90 (unit deg)",
    ]


def test_a_rule_between_two_parameters_refuses_only_what_no_point_allows() -> None:
    axes = read(f"{LOW}=0.2,1.5", f"{HIGH}=1.0,2.0")
    points = grid(axes)
    check_points(RIG, axes, points)  # 1.5 and 1.0 exclude each other: their runs report it
    axes = read(f"{LOW}=2.5,3.0", f"{HIGH}=1.0,2.0")
    with pytest.raises(ConfigError, match="max_salience must be above min_salience"):
        check_points(RIG, axes, grid(axes))


AXES = (
    Axis("a", (), -2.0, 5.0), Axis("b", (), 1.0, 6.0, whole=True), Axis("c", ("x", "y", "z")),
)  # fmt: skip


@settings(deadline=None, max_examples=60)
@given(st.integers(2, 60), st.integers(0, 2**32))
def test_a_latin_hypercube_falls_once_into_each_part_of_every_axis(n: int, seed: int) -> None:
    points = latin_hypercube(AXES, n, seed)
    assert len(points) == n and points == latin_hypercube(AXES, n, seed)
    parts = sorted(int((float(str(point["a"])) + 2.0) / 7.0 * n * (1 - 1e-6)) for point in points)
    near = [abs(part - k) <= 1 for k, part in enumerate(parts)]  # six digits are kept
    assert all(near) and len(set(parts)) >= n - 1
    assert all(-2.0 <= float(str(point["a"])) <= 5.0 for point in points)
    whole = Counter(point["b"] for point in points)
    assert set(whole) <= set(range(1, 7)) and all(isinstance(b, int) for b in whole)
    assert all(abs(whole[b] - n / 6) < 2 for b in range(1, 7))
    levels = Counter(point["c"] for point in points)
    assert all(abs(levels[c] - n / 3) < 2 for c in "xyz")


@settings(deadline=None, max_examples=60)
@given(st.floats(0.0, 1.0), st.sampled_from(AXES))
def test_a_share_of_an_axis_is_a_value_of_it_and_back(share: float, axis: Axis) -> None:
    value = axis.at(share)
    assert axis.at(axis.share(value)) == value
    assert 0.0 <= axis.share(value) <= 1.0


def test_points_are_changes_of_a_rig() -> None:
    (point,) = latin_hypercube(read(f"{COMFORT}=4:16"), 2, 0)[:1]
    assert changed(RIG, point).gaze.head.comfort_deg == point[COMFORT]
