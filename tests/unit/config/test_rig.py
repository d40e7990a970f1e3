"""The shipped rig files, and the rules between their sections."""

import re
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mixed_rig import mixed_text

from gazerig.config.load import ConfigError, shipped_names, shipped_path
from gazerig.config.parameters import (
    LIVE_LIMITS,
    NEXT_START,
    apply_changes,
    differences,
    parameters,
    value_of,
)
from gazerig.config.schema import Rig, load_rig, load_rules, load_walk
from gazerig.params import declarations

DESK = shipped_path("rigs", "desk")


def broken(tmp_path, *changes):
    text = DESK.read_text(encoding="utf-8")
    for old, new in changes:
        assert len(re.findall(old, text, flags=re.M)) >= 1, old
        text = re.sub(old, new, text, count=1, flags=re.M)
    path = tmp_path / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(path))
    return tuple(str(fault) for fault in caught.value.faults)


def test_shipped_profiles_characters_and_walks_load():
    ranges = {name: load_rig("desk", profile=name).ranges for name in shipped_names("profiles")}
    assert (ranges["mitake"].eye_yaw_deg, ranges["mitake"].eye_pitch_deg) == (55.0, 45.0)
    assert ranges["nakamoto"].eye_yaw_deg == 19.0  # the joint reaches the paper's 20 in a jump
    assert load_rig("desk").ranges == ranges["robot"]
    assert load_rig("desk", profile="nakamoto").gaze.saccade.profile == "literal_frame"
    assert load_rig("desk", profile="mitake").gaze.bottom_up.form == "literal"
    for name in shipped_names("characters"):
        assert load_rig("desk", character=name).gaze != load_rig("desk").gaze
    for name in shipped_names("rules"):
        assert "wait" in load_rules(name).rules
    for name in shipped_names("scanpaths"):
        load_walk(name)


@pytest.mark.parametrize(
    ("key", "slip", "near"), [("character", "shi", "shy"), ("profile", "robott", "robot")]
)
def test_a_rig_names_its_profile_and_character(tmp_path, key, slip, near):
    file, text = tmp_path / "mine.yaml", DESK.read_text(encoding="utf-8")
    text = text.replace("profile: robot ", "character: shy\nprofile: robot ")
    file.write_text(text, encoding="utf-8")
    own = load_rig(str(file))
    assert own == replace(load_rig("desk", "shy"), character="shy")
    assert load_rig(str(file), "bold").gaze == load_rig("desk", "bold").gaze
    assert load_rig(str(file), "none").gaze == load_rig("desk").gaze
    file.write_text(text.replace(f"{key}: {near}", f"{key}: {slip}"), encoding="utf-8")
    with pytest.raises(ConfigError, match=f"did you mean '{near}'.*available: ") as refused:
        load_rig(str(file))
    line = text[: text.index(f"\n{key}: ")].count("\n") + 2
    assert str(refused.value).startswith(f"{file}:{line}: {key}: ")


@pytest.mark.parametrize(
    ("old", "new", "place", "rule"),
    [
        (r"^    id: 9$", "    id: 1", "joints.neck_roll.id", "id 1 on bus is already used by"),
        (r"model: xc330-m288", "model: xc330", "joints.neck_yaw.model", "no servo model 'xc330'"),
        (r"model: xc330-m288", "model: XC330-M288", "joints.neck_yaw.model", "mean 'xc330-m288'?"),
        (r"^  neck_roll:", "  neck_rol:", "joints", "neck_roll"),
        (r"left_deg: \[-25.0", "left_deg: [-80.0", "lid_joints.left_deg", "outside"),
        (r"neck_pitch: -12.0", "neck_pitch: -90.0", "park_deg.neck_pitch", "outside"),
        (r"min_deg: -35.0", "min_deg: 40.0", "joints.left_eye_pan", "below max_deg"),
        (r"rate_hz: 200.0", "rate_hz: .nan", "loop.rate_hz", "number"),
        (r"rate_hz: 200.0", 'rate_hz: "200"', "loop.rate_hz", "number"),
        (r"rate_hz: 200.0", "rate_hz: 2000.0", "loop.rate_hz", "20 to 1000 Hz"),
        (r"interocular_mm", "interocular", "geometry", "interocular_mm"),
        (r"^    zero_step: 2048", "    zero_step: 20", "joints.left_eye_pan", "0..4095"),
        (r"^lid_joints:(.*\n  .*)*", "", "lid_joints.left_deg", "left_upper_lid needs it"),
        (r"left_deg: .*", "left_deg: [-25.0]", "lid_joints.left_deg", "a list of 2"),
    ],
)
def test_rules_between_sections(old, new, place, rule, tmp_path):
    faults = broken(tmp_path, (old, new))
    assert any(re.search(r"rig\.yaml:\d+", f) and place in f and rule in f for f in faults), faults


# Rigs with other joints and other buses than the desk's: valid files, and the result


def faults(tmp_path, text):
    file = tmp_path / "wrong.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(file))
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "bus: neck",
            "bus: nack",
            "joints.neck_yaw.bus: no bus 'nack'; did you mean 'neck'? available: neck",
        ),
        (
            "model: sts3215",
            "model: xl330-m077",
            "needs a bus of kind dynamixel, its bus is of kind feetech",
        ),
        (
            "/dev/ttyUSB0",
            "/dev/ttyACM0",
            "buses.neck.port: /dev/ttyACM0 is already used by bus.port",
        ),
        ("id: 5", "id: 12", "joints.right_lower_lid.id: the board has channels 0 to 11"),
        (", bus: tilt", "", "joints.neck_pitch.model: a sts3215 needs a bus of kind feetech"),
        (
            "id: 4\n",
            "id: 3\n",
            "joints.left_lower_lid.id: id 3 on bus is already used by joints.right_upper_lid.id",
        ),
        (
            "left_lower_deg: [-8.0, 22.0]",
            "left_lower_deg: [22.0, 22.0]",
            "a lid's shut and open angles must differ",
        ),
        (
            "eyes_tilt:",
            "left_eye_tilt:",
            "use either left_eye_tilt and right_eye_tilt, or eyes_tilt alone",
        ),
        ("kind: maestro", "kind: maestra", "bus.kind"),
        ("com_mm: [0, 0, 0]", "mass_kg: 0.01", "the head weighs 0.01 kg with all it carries"),
    ],
)
def test_what_cannot_be_is_said(tmp_path, old, new, says):
    text = mixed_text()
    assert old in text
    said = faults(tmp_path, text.replace(old, new, 1))
    assert says in said, said


# --- Knobs: every parameter of a rig by its key, with the rules and words of its file


@pytest.fixture(scope="module")
def knobs(desk_rig):
    return parameters(desk_rig, desk_rig)


def test_all_have_words_and_structure_waits_for_the_next_start(knobs, desk_rig):
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


@settings(max_examples=30, deadline=None)
@given(st.data())
def test_any_number_within_its_bounds_comes_back_or_breaks_a_rule(desk_rig, knobs, data):
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


# --- One line declares a parameter; its unit is in its name


def shapes(params):
    found = list(declarations(params).values())
    for shape in list(found):
        inner = shape.inner or shape
        if inner.params is not None:
            found += shapes(inner.params)
    return found


def test_every_parameter_of_a_rig_is_described_and_every_number_bounded():
    every = shapes(Rig)
    assert len(every) > 150 and all(shape.description for shape in every)
    numbers = [shape for shape in every if shape.form in ("number", "whole")]
    assert len(numbers) > 60 and all(shape.low is not None for shape in numbers)
