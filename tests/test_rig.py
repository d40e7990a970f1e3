"""The shipped rig files, and the rules between their sections."""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import pytest
from desk import GAZE_JOINTS

from gazerig.config.load import ConfigError, shipped, shipped_names
from gazerig.config.save_text import comment
from gazerig.config.schema import Rig, load_rig, load_rules, load_walk

DESK = shipped("rigs", "desk")


def broken(tmp_path: Path, *changes: tuple[str, str]) -> tuple[str, ...]:
    text = DESK.read_text(encoding="utf-8")
    for old, new in changes:
        assert len(re.findall(old, text, flags=re.M)) >= 1, old
        text = re.sub(old, new, text, count=1, flags=re.M)
    path = tmp_path / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(path))
    return tuple(str(fault) for fault in caught.value.faults)


def test_the_desk_rig_is_the_head_described() -> None:
    rig = load_rig("desk")
    assert [rig.joints[name].id for name in GAZE_JOINTS] == list(range(1, 10))
    assert {rig.joints[name].model for name in GAZE_JOINTS[:6]} == {"xl330-m077"}
    assert {rig.joints[name].model for name in GAZE_JOINTS[6:]} == {"xc330-m288"}
    assert rig.bus.dynamixel.baud == 1_000_000
    assert rig.geometry.interocular_mm == 61.9
    pan, tilt = rig.joints["left_eye_pan"], rig.joints["right_eye_tilt"]
    assert (pan.min_deg, pan.max_deg, tilt.min_deg, tilt.max_deg) == (-35, 35, -30, 30)


SHORT = ("simple_order",)
"""Keys whose choices stand above them, not again in their comment."""


def test_every_key_of_the_desk_rig_is_commented() -> None:
    lines = DESK.read_text(encoding="utf-8").splitlines()
    names = rf"\s*({'|'.join(GAZE_JOINTS)}|wait|guard|attack):"
    keys, plain = 0, []
    for above, line in pairwise(lines):
        if not re.match(r"\s*\w+:", line):
            continue
        keys += 1
        if "#" not in line and not re.match(names, line) and not above.strip().startswith("#"):
            plain.append(line)
    assert keys > 150 and plain == []


def test_the_desk_rig_explains_its_keys_as_they_are_declared() -> None:
    lines = DESK.read_text(encoding="utf-8").splitlines()
    seen, other = 0, []
    path: list[str] = []
    for number, line in enumerate(lines):
        found = re.match(r"( *)(\w+):", line)
        if found is None:
            continue
        path = [*path[: len(found[1]) // 2], found[2]]
        if path[0] not in ("gaze", "guard", "tracks", "loop", "motion", "detector", "oak"):
            continue
        said = line.partition("  # ")[2]
        above = number - 1
        while not said and lines[above].strip().startswith("#"):
            above -= 1
        said = said or " ".join(one.strip()[2:] for one in lines[above + 1 : number])
        seen += 1
        if said != comment(Rig, path) and path[-1] not in ("wait", "guard", "attack", *SHORT):
            other.append((".".join(path), said, comment(Rig, path)))
    assert seen > 200 and other == []


def test_the_desk_rig_spells_out_every_default(tmp_path: Path) -> None:
    """What stands in the file is what the rooms would take without it."""
    text = DESK.read_text(encoding="utf-8")
    short = tmp_path / "short.yaml"
    cut = re.split(r"^gaze:", text, flags=re.M)[0]
    short.write_text(cut, encoding="utf-8")
    whole, cut_rig = load_rig("desk"), load_rig(str(short))
    assert (
        whole.gaze == cut_rig.gaze == cast(Any, Rig.__dataclass_fields__["gaze"]).default_factory()
    )


def test_shipped_profiles_characters_and_walks_load() -> None:
    ranges = {name: load_rig("desk", profile=name).ranges for name in shipped_names("profiles")}
    assert (ranges["mitake"].eye_yaw_deg, ranges["mitake"].eye_pitch_deg) == (55.0, 45.0)
    assert ranges["nakamoto"].eye_yaw_deg == 20.0
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
    ("old", "new", "place", "rule"),
    [
        (r"^    id: 9 ", "    id: 1 ", "joints.neck_roll.id", "id 1 is already that of"),
        (r"model: xc330-m288", "model: xc330", "joints.neck_yaw.model", "unknown servo model"),
        (r"^  neck_roll:", "  neck_rol:", "joints", "neck_roll"),
        (r"left_shut_deg: -25.0", "left_shut_deg: -80.0", "lid_joints.left_shut_deg", "outside"),
        (r"neck_pitch: -12.0", "neck_pitch: -90.0", "park_deg.neck_pitch", "outside"),
        (r"min_deg: -35.0", "min_deg: 40.0", "joints.left_eye_pan", "below max_deg"),
        (r"rate_hz: 200.0", "rate_hz: .nan", "loop.rate_hz", "number"),
        (r"rate_hz: 200.0", 'rate_hz: "200"', "loop.rate_hz", "number"),
        (r"rate_hz: 200.0", "rate_hz: 2000.0", "loop.rate_hz", "above 1000"),
        (r"interocular_mm", "interocular", "geometry", "interocular_mm"),
        (r"^    zero_step: 2048", "    zero_step: 20", "joints.left_eye_pan", "0..4095"),
        (r"max_salience: 1.0", "max_salience: 0.1", "gaze.head", "above min_salience"),
        (r"^lid_joints:(.*\n  .*)*", "", "lid_joints.left_shut_deg", "left_upper_lid needs it"),
        (r"^  left_open_deg.*\n", "", "lid_joints", "left upper lid one end is missing; give both"),
    ],
)
def test_rules_between_sections(old: str, new: str, place: str, rule: str, tmp_path: Path) -> None:
    faults = broken(tmp_path, (old, new))
    assert any(re.search(r"rig\.yaml:\d+", f) and place in f and rule in f for f in faults), faults


def test_all_faults_come_in_one_message(tmp_path: Path) -> None:
    faults = broken(
        tmp_path,
        (r"^    id: 9 ", "    id: 8 "),
        (r"rate_hz: 200.0", "rate_hz: -1.0"),
        (r"^name: desk", "naem: desk"),
        (r"min_duration_ms: 50.0", "min_duration_ms: fast"),
    )
    text = "\n".join(faults)
    for part in ("id 8 is already", "rate_hz", "naem", "missing", "min_duration_ms"):
        assert part in text
