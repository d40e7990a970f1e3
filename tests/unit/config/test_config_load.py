"""YAML to frozen values: every fault with its file and line, layer over layer."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
from fakes.small_config import Camera, Joint, Rig, faults_of, one_id_each, write

from gazerig.config.load import ConfigError, load
from gazerig.config.validation import validate
from gazerig.params import Bounds


def has_neck(rig):
    if "neck" not in rig.joints:
        yield "joints", "there is no neck"


def camera_keeps_up(rig):
    if rig.camera.fps < 10:
        yield "camera.fps", "too slow to follow a face"


CHECKS = (one_id_each, has_neck, camera_keeps_up)

GOOD = """\
# a rig
name: nod
joints:
  neck: {id: 1}
  pan:
    id: 2             # ours
    max_speed_deg_s: 500
camera:
  offset_m: [0, 0.5, -1e-2]
"""


def test_a_right_file_becomes_the_frozen_value(tmp_path):
    rig = load(write(tmp_path, GOOD), Rig, checks=CHECKS)
    assert rig == Rig(
        name="nod",
        joints={"neck": Joint(1), "pan": Joint(2, max_speed_deg_s=500.0)},
        camera=Camera(offset_m=(0.0, 0.5, -0.01)),
    )


CORNERS = """\
name: nod
joints: {low: {id: 0}, high: {id: 252, max_speed_deg_s: 1}}
camera: {}
spare: null
gains: {x: 0}
matrix: [[0, 1], [0.5], []]
line: 1000000
kind: round
pair: [9, -9]
tags: [a, b]
"""


def test_values_at_their_bounds_whole_numbers_and_empty_sections_are_right(tmp_path):
    assert load(write(tmp_path, CORNERS), Rig) == Rig(
        name="nod",
        joints={"low": Joint(0), "high": Joint(252, 1.0)},
        gains={"x": 0.0},
        matrix=((0.0, 1.0), (0.5,), ()),
        line=1_000_000,
        kind="round",
        pair=(9, -9),
        tags=("a", "b"),
    )


def test_a_default_outside_its_own_bounds_is_found():
    @dataclass(frozen=True)
    class Slip:
        rate_hz: Annotated[float, Bounds(0, 200)] = 500.0

    _, errors = validate(Slip, {})
    assert [error.rule for error in errors] == ["is 500.0, wanted a number, 0 to 200 Hz"]


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("baud: 0x10", 16),
        ("baud: 0o17", 15),
        ("baud: 007", 7),
        ("baud: +5", 5),
    ],
)
def test_whole_numbers_are_those_of_yaml_1_2(tmp_path, line, value):
    assert load(write(tmp_path, GOOD + line + "\n"), Rig).baud == value


@pytest.mark.parametrize("word", ["no", "on", "yes", "2026-01-31", "1:30", "=", "0.1.2", "'5'"])
def test_words_that_look_like_something_else_are_text(tmp_path, word):
    file = write(tmp_path, GOOD.replace("nod", word))
    assert load(file, Rig).name == word.strip("'")


@pytest.mark.parametrize(
    ("change", "to", "fault"),
    [
        (
            "joints:",
            "joint:",
            "2: joints: missing; wanted a mapping, each "
            "a mapping with the keys id, max_speed_deg_s, low_deg, high_deg\n"
            "3: joint: unknown key; did you mean 'joints'? "
            "allowed: name, joints, camera, spare, dwell, gains, matrix, baud, line, kind, pair, tags",
        ),
        ("name: nod", "name: 5", "2: name: is 5, wanted text"),
        (
            "name: nod",
            "name: nod\nspare: 1",
            "3: spare: is 1, wanted a mapping with the keys fps, offset_m, face or null",
        ),
        (
            "name: nod",
            "name: nod\ngains: []",
            "3: gains: is [], wanted a mapping, each a number, 0 to 1e+308",
        ),
        ("max_speed_deg_s: 500", "low_deg: 30", "5: joints.pan: low_deg must be below high_deg"),
        ("id: 2", "id: 1", "6: joints.pan.id: id 1 is also that of neck"),
        ("neck", "nekc", "3: joints: there is no neck"),
        ("offset_m: [0, 0.5, -1e-2]", "fps: 2", "9: camera.fps: too slow to follow a face"),
        ("name: nod", "name: nod\nname: x", "3: name: duplicate key, first in line 2"),
        (
            "500",
            "500,5",
            "7: joints.pan.max_speed_deg_s: column 25 is a decimal comma (,); write '.'",
        ),
        (
            "0.5",
            "\u22120.5",
            "9: camera.offset_m.1: column 17 is a typographic minus (−); write '-'",
        ),
        (
            "0.5",
            "0.5\u00a0",
            "9: camera.offset_m.1: column 20 is a no-break space (\u00a0); write ' '",
        ),
        ("nod", "“nod”", "2: name: column 7 is a typographic quote (“); write '\"'"),
    ],
)
def test_each_fault_alone(tmp_path, change, to, fault):
    assert GOOD.count(change) == 1
    found = faults_of(tmp_path, GOOD.replace(change, to), CHECKS)
    assert found == [f"rig.yaml:{line}" for line in fault.splitlines()]


ALL_WRONG = """\
joints:
  neck: {id: 300}
  pan: {id: 4, max_sped_deg_s: 3}
  tilt: {id: 5, max_speed_deg_s: 9000.0}
  roll: {low_deg: true, id: "6"}
  lid_left: {}
  lid_right:
    id: 5
    low_deg: 40
    low_deg: 50
  eye_left: {id: 4}
  eye_right:
    id: 5
  brow: {id: }
camera: {fps: 3.5, offset_m: [1, 2]}
spare:
  fps: 9999
  offset_m: [1, 2, 3, 4]
  face: 1
dwell: gama
gains: {x: -1, y: .inf}
matrix: [[0, x],
  [1, 2], 3]
baud: '57600'
colour: red
line: 9600
kind: rond
pair: [1, 10]
tags: {}
"""

ALL_FAULTS = """\
rig.yaml:1: name: missing; wanted text
rig.yaml:2: joints.neck.id: is 300, wanted a whole number, 0 to 252
rig.yaml:3: joints.pan.max_sped_deg_s: unknown key; did you mean \
'max_speed_deg_s'? allowed: id, max_speed_deg_s, low_deg, high_deg
rig.yaml:4: joints.tilt.max_speed_deg_s: is 9000.0, wanted a number, 1 to 2000 deg/s
rig.yaml:5: joints.roll.id: is '6', wanted a whole number, 0 to 252
rig.yaml:5: joints.roll.low_deg: is True, wanted a number in deg
rig.yaml:6: joints.lid_left.id: missing; wanted a whole number, 0 to 252 (servo id)
rig.yaml:7: joints.lid_right: low_deg must be below high_deg
rig.yaml:10: joints.lid_right.low_deg: duplicate key, first in line 9
rig.yaml:14: joints.brow.id: is empty, wanted a whole number, 0 to 252
rig.yaml:15: camera.fps: is 3.5, wanted a whole number, 1 to 120 Hz
rig.yaml:15: camera.offset_m: is [1, 2], wanted a list of 3, each a number in m
rig.yaml:17: spare.fps: is 9999, wanted a whole number, 1 to 120 Hz
rig.yaml:18: spare.offset_m: is [1, 2, 3, 4], wanted a list of 3, each a number in m
rig.yaml:19: spare.face: is 1, wanted true or false
rig.yaml:20: dwell: is 'gama', wanted 'gamma' or 'lognormal'; did you mean 'gamma'?
rig.yaml:21: gains.x: is -1, wanted a number, 0 to 1e+308
rig.yaml:21: gains.y: is '.inf', wanted a number, 0 to 1e+308
rig.yaml:22: matrix.0.1: is 'x', wanted a number
rig.yaml:23: matrix.2: is 3, wanted a list, each a number
rig.yaml:24: baud: is '57600', wanted a whole number in bit/s
rig.yaml:25: colour: unknown key; allowed: name, joints, camera, spare, dwell, gains, \
matrix, baud, line, kind, pair, tags
rig.yaml:26: line: is 9600, wanted 57600 or 1000000
rig.yaml:27: kind: is 'rond', wanted 'flat' or 'round'; did you mean 'round'?
rig.yaml:28: pair.1: is 10, wanted a whole number, -9 to 9
rig.yaml:29: tags: is {}, wanted a list, each text"""


def test_all_faults_together_in_one_message(tmp_path):
    assert faults_of(tmp_path, ALL_WRONG, CHECKS) == ALL_FAULTS.splitlines()


# ---- layers -----------------------------------------------------------------------------


def test_later_layers_win_key_by_key(tmp_path):
    base = write(tmp_path, GOOD + "spare: {fps: 10}\nmatrix: [[1], [2]]\n", "base.yaml")
    middle = write(tmp_path, "joints: {pan: {low_deg: -5}, tilt: {id: 3}}\n", "middle.yaml")
    top = write(tmp_path, "joints: {pan: {id: 9}}\nspare:\nmatrix: [[3]]\n", "top.yaml")
    rig = load(top, Rig, defaults=[base, middle], checks=CHECKS)
    assert rig.joints == {
        "neck": Joint(1),
        "pan": Joint(9, max_speed_deg_s=500.0, low_deg=-5.0),
        "tilt": Joint(3),
    }
    assert (rig.name, rig.spare, rig.matrix) == ("nod", None, ((3.0,),))
    assert rig.camera.offset_m == (0.0, 0.5, -0.01)


def test_a_fault_names_the_layer_its_value_comes_from(tmp_path):
    base = write(tmp_path, GOOD.replace("500", "9000").replace("nod", "5"), "base.yaml")
    top = write(
        tmp_path, "\n\njoints:\n  pan:\n    id: 1\n  tilt: {}\nname: ok\nfps: 3\n", "top.yaml"
    )
    with pytest.raises(ConfigError) as caught:
        load(top, Rig, defaults=[base], checks=CHECKS)
    assert [(Path(f.file).name, f.line, f.key) for f in caught.value.faults] == [
        ("base.yaml", 7, "joints.pan.max_speed_deg_s"),
        ("top.yaml", 5, "joints.pan.id"),
        ("top.yaml", 6, "joints.tilt.id"),
        ("top.yaml", 8, "fps"),
    ]
