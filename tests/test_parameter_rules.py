"""Knobs: every parameter of a rig by its key, with the rules and words of its file."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.load import ConfigError, shipped_names
from gazerig.config.parameters import (
    LIVE_LIMITS,
    NEXT_START,
    apply_changes,
    differences,
    parameters,
    value_of,
)
from gazerig.config.schema import Rig, load_rig
from gazerig.robot.model.commands import Value
from gazerig.robot.model.parameter import Parameter

LENS = {"size_px": (640, 480), "focal_px": (500.0, 500.0)}


@pytest.fixture(scope="module")
def knobs(desk_rig: Rig) -> tuple[Parameter, ...]:
    return parameters(desk_rig, desk_rig)


def test_all_have_words_and_structure_waits_for_the_next_start(
    knobs: tuple[Parameter, ...], desk_rig: Rig
) -> None:
    waiting = {parameter.key for parameter in knobs if parameter.live == NEXT_START}
    assert {"bus.port", "joints.neck_yaw.id", "oak.rate_hz", "camera.mount", "name"} <= waiting
    live = {parameter.key for parameter in knobs} - waiting
    assert {
        key for key in live if not key.startswith(("gaze.", "ranges.", "guard.", "tracker."))
    } == {
        "sound.device",
        "character",
        *(f"joints.{name}.{key}" for name in desk_rig.joints for key in LIVE_LIMITS),
    }
    assert {
        key for key in waiting if key.startswith(("gaze.", "ranges.", "guard.", "tracker."))
    } == {
        "gaze.chooser"  # of a package, perhaps, which is loaded at the start
    }
    for parameter in knobs:
        assert parameter.description, parameter.key
        assert parameter.kind != "choice" or parameter.choices, parameter.key


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"loop.rate_hz": 5000.0}, "loop.rate_hz: is 5000.0, wanted a number, 20 to 1000 Hz"),
        ({"gaze.lid.x": 1}, "gaze.lid: unknown key; did you mean 'lids'?"),
        ({"loop.rate_hz.x": 1}, "loop.rate_hz: is {'x': 1}, wanted a number"),
        ({"loop.rate_hz": float("nan")}, "is nan, wanted a number"),
        ({"joints.neck_yaw.max_deg": -80.0}, "min_deg -70.0 must be below max_deg -80.0"),
        ({"joints.neck_yaw.id": 1}, "id 1 on bus is already used by joints.left_eye_pan.id"),
        ({"park_deg.neck_pitch": -50.0}, "-50.0 is outside the joint's range -35.0..35.0"),
        ({"joints.left_upper_lid.min_deg": -5.0}, "lid_joints.left_deg"),
        ({"gaze.top_down.rules.wait": None}, "behaviour 'wait' has no rule"),
        ({"face_parts_mm.XX": (1.0, 2.0, 3.0)}, "no face part 'XX'; available: DN"),
    ],
)
def test_what_is_wrong_is_refused_in_the_words_of_a_file(
    desk_rig: Rig, changes: dict[str, object], words: str
) -> None:
    with pytest.raises(ConfigError) as refused:
        apply_changes(desk_rig, changes)  # type: ignore[arg-type]
    assert words in str(refused.value)


@pytest.mark.parametrize("name", shipped_names("characters"))
def test_differences_turn_one_rig_into_the_other_and_back(desk_rig: Rig, name: str) -> None:
    other = load_rig("desk", name)
    found = differences(desk_rig, other)
    assert found and apply_changes(desk_rig, found) == other
    assert apply_changes(other, differences(other, desk_rig)) == desk_rig


def test_entries_and_groups_come_and_go(desk_rig: Rig) -> None:
    rule: dict[str, Value] = {"look_at": "hand", "salience": 1.0}
    other = apply_changes(
        desk_rig,
        {
            "gaze.top_down.rules.point": rule,
            "face_parts_mm.N": (1, 2, 3),
            "park_deg.neck_yaw": 3.0,
            "camera.lens": {**LENS, "centre_px": (320.0, 240.0)},
        },
    )
    assert other.face_parts_mm == {"N": (1.0, 2.0, 3.0)}
    assert value_of(other, "gaze.top_down.rules.point.salience") == 1.0
    assert apply_changes(desk_rig, differences(desk_rig, other)) == other
    assert apply_changes(other, differences(other, desk_rig)) == desk_rig
    flat = differences(desk_rig, other)
    assert flat["gaze.top_down.rules.point.look_at"] == "hand"
    assert flat["camera.lens.focal_px"] == (500.0, 500.0)


def test_an_unknown_key_has_no_value(desk_rig: Rig) -> None:
    with pytest.raises(ConfigError, match="no key 'lid'; did you mean 'lids'"):
        value_of(desk_rig, "gaze.lid")


@settings(max_examples=30, deadline=None)
@given(st.data())
def test_any_number_within_its_bounds_comes_back_or_breaks_a_rule(
    desk_rig: Rig, knobs: tuple[Parameter, ...], data: st.DataObject
) -> None:
    numbers = [k for k in knobs if k.kind in ("number", "whole") and k.low is not None]
    parameter = data.draw(st.sampled_from(numbers))
    assert parameter.low is not None and parameter.high is not None
    whole = st.integers(int(parameter.low), int(parameter.high))
    value = data.draw(
        whole if parameter.kind == "whole" else st.floats(parameter.low, parameter.high)
    )
    try:
        other = apply_changes(desk_rig, {parameter.key: value})
    except ConfigError as refused:
        assert all(fault.rule for fault in refused.faults)
        return
    assert value_of(other, parameter.key) == value
    assert set(differences(desk_rig, other)) <= {parameter.key}
