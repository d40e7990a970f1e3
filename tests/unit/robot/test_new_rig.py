"""gazerig new: what it says, what it writes, and that every rig it writes runs."""

import itertools
from pathlib import Path

import pytest
from command_line import invoked, typed

from gazerig.config.schema import load_rig
from gazerig.config.shipped_files import SHIPPED
from gazerig.robot.cli.new import BOARDS, CAMERAS, MECHANISMS, NewRig, joints_of, rig_text

TEMPLATES = {
    "minimal": ("--board", "dynamixel", "--joints", "eyes", "--camera", "webcam"),
    "six_hobby": ("--board", "maestro", "--joints", "eyes-lids", "--camera", "webcam"),
    "six_xl330": ("--board", "dynamixel", "--joints", "two-eyes", "--camera", "webcam"),
    "nine_xl330": ("--board", "dynamixel", "--joints", "head", "--camera", "webcam"),
}
"""Shipped rigs, each as ``gazerig new`` writes it with these options."""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_shipped_template_is_what_new_writes(name):
    assert typed("new", f"{name}.yaml", *TEMPLATES[name]) == 0
    shipped = SHIPPED / "rigs" / f"{name}.yaml"
    assert Path(f"{name}.yaml").read_text("utf-8") == shipped.read_text("utf-8")


@pytest.mark.parametrize("board", BOARDS)
def test_every_board_with_every_mechanism_and_camera_is_good(board):
    for mechanism, camera in itertools.product(MECHANISMS, CAMERAS):
        new = NewRig("mine", board, joints_of(mechanism), camera)
        file = Path("mine.yaml")
        file.write_text(rig_text(new), "utf-8")
        rig = load_rig(str(file))
        assert set(rig.joints) == set(new.joints)
        assert rig.bus.kind == ("dynamixel" if board == "none" else board)
        assert rig.camera.mount == ("head" if new.has_neck or camera == "none" else "base")


def test_joints_by_name_get_ids_in_their_order():
    assert typed("new", "a.yaml", "--board", "pca9685", "--joints", "eyes_tilt,eyes_pan, jaw") == 0
    joints = load_rig("a.yaml").joints
    assert [(name, joints[name].id) for name in ("eyes_tilt", "eyes_pan", "jaw")] == [
        ("eyes_tilt", 0),
        ("eyes_pan", 1),
        ("jaw", 2),
    ]


def test_what_is_left_out_is_said_with_its_choices():
    done = invoked("new", "a.yaml", "--joints", "eyes")
    assert done.code == 0, done.err
    assert "board: none; --board NAME" in done.err and "  feetech " in done.err
    assert "camera: webcam" in done.err and "joints:" not in done.err
    assert "gazerig run a.yaml --mock" in done.out and "calibrate" not in done.out


def test_the_next_steps_are_those_of_board_and_camera():
    done = invoked("new", "a.yaml", "--board", "maestro", "--camera", "oak")
    rig = load_rig("a.yaml")
    assert rig.bus.kind == "maestro" and "left_eye_pan" not in rig.joints
    assert rig.camera.horizontal_field_deg == 69
    steps = [line.split("  ")[1] for line in done.out.splitlines()[1:5]]
    assert steps == [
        "gazerig run a.yaml --mock",
        "gazerig doctor a.yaml --fix",
        "gazerig calibrate a.yaml",
        "gazerig run a.yaml --oak",
    ]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("a.yaml", "--board", "arduino"), "arduino"),
        (("a.txt",), "a.txt: a rig's file ends in .yaml: gazerig new a.yaml"),
        (("a.yaml", "--joints", "eyes_pan"), "or eyes_tilt alone if one servo turns both"),
        (("a.yaml", "--joints", "eyes_pan,eyes_tilt,Jaw"), "not a valid joint name"),
        (("there.yaml",), "there.yaml already exists"),
    ],
)
def test_what_cannot_be_is_one_clear_line_and_writes_nothing(words, told):
    Path("there.yaml").write_text("mine", "utf-8")
    done = invoked("new", *words)
    assert done.code == 2 and told in done.err, done.err
    assert [path.name for path in Path(".").iterdir()] == ["there.yaml"]
    assert Path("there.yaml").read_text("utf-8") == "mine"
