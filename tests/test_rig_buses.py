"""Rigs with other joints and other buses than the desk's: what a file may say, and what is made."""

import re
from pathlib import Path

import pytest
from mixed_rig import mixed_text

from gazerig.config.load import ConfigError
from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.bus.multi_bus import MultiBus
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.bus_wiring import bus_names, joints_on, ports_of, rig_setups
from gazerig.robot.app.options import RunOptions


@pytest.fixture
def mixed(tmp_path: Path) -> Rig:
    file = tmp_path / "mixed.yaml"
    file.write_text(mixed_text(), encoding="utf-8")
    return load_rig(str(file))


def faults(tmp_path: Path, text: str) -> str:
    file = tmp_path / "wrong.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(file))
    return str(caught.value)


def test_joints_stand_in_their_order_whatever_bus_they_are_on(mixed: Rig) -> None:
    assert mixed.names == (
        "eyes_pan", "eyes_tilt", "left_upper_lid", "right_upper_lid", "left_lower_lid",
        "right_lower_lid", "neck_yaw", "neck_pitch",
    )  # fmt: skip
    assert bus_names(mixed) == ("", "neck", "tilt")
    assert joints_on(mixed, "neck") == ("neck_yaw",)
    assert [setup.name for setup in rig_setups(mixed)] == list(mixed.names)
    rests = {setup.name: setup.rest_steps for setup in rig_setups(mixed)}
    assert rests["neck_yaw"] is None and rests["neck_pitch"] is None
    lid = mixed.joints["left_upper_lid"]
    assert rests["left_upper_lid"] == round(lid.made().steps(-20.0 * 3.141592653589793 / 180.0))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("bus: neck", "bus: nack", "joints.neck_yaw.bus: no bus 'nack' under buses; there is neck"),
        ("model: sts3215", "model: xl330-m077", "speaks dynamixel, and its bus is of kind feetech"),
        ("/dev/ttyUSB0", "/dev/ttyACM0", "buses.neck.port: /dev/ttyACM0 is already that of bus"),
        ("id: 5", "id: 12", "joints.right_lower_lid.id: the board has channels 0 to 11"),
        (", bus: tilt", "", "joints.neck_pitch.model: a sts3215 speaks feetech"),
        ("id: 4\n", "id: 3\n", "joints.left_lower_lid.id: id 3 is already that of right_upper_lid"),
        (
            "left_lower_shut_deg: -8.0",
            "left_lower_shut_deg: null",
            "of the left lower lid one end is missing",
        ),
        ("eyes_tilt:", "left_eye_tilt:", "nothing turns an eye in tilt"),
        ("kind: maestro", "kind: maestra", "bus.kind"),
    ],
)
def test_what_cannot_be_is_said(tmp_path: Path, old: str, new: str, says: str) -> None:
    text = mixed_text()
    assert old in text
    said = faults(tmp_path, text.replace(old, new, 1))
    assert says in said, said


def test_an_eye_has_one_master(tmp_path: Path) -> None:
    own = re.search(r"  eyes_pan:.*?(?=\n  eyes_tilt:)", mixed_text(), re.S)
    assert own is not None
    text = mixed_text().replace(
        "\nlid_joints:", own[0].replace("eyes_pan", "left_eye_pan").join(("\n", "\nlid_joints:"))
    )
    said = faults(tmp_path, text.replace("id: 0", "id: 9", 1))
    assert "joints.eyes_pan: turns both eyes, which left_eye_pan would do as well" in said


def test_a_lid_needs_its_ends(tmp_path: Path) -> None:
    text = re.sub(r"  left_lower_(shut|open)_deg.*\n", "", mixed_text())
    assert "lid_joints.left_lower_shut_deg: missing; the joint left_lower_lid needs it" in faults(
        tmp_path, text
    )


def test_ports_are_named_by_their_bus(mixed: Rig) -> None:
    assert ports_of(mixed, None)["tilt"] == "/dev/ttyACM1"
    given = ports_of(mixed, "/dev/x,neck=/dev/y")
    assert (given[""], given["neck"], given["tilt"]) == ("/dev/x", "/dev/y", "/dev/ttyACM1")
    with pytest.raises(SetupError, match="it can be PORT, neck=PORT, tilt=PORT"):
        ports_of(mixed, "lids=/dev/z")
    assert ports_of(load_rig("maker"), "/dev/z") == {"": "/dev/z"}


def test_one_bus_is_itself_and_several_are_one(mixed: Rig) -> None:
    from gazerig.robot.app.assemble import assemble

    made = assemble(mixed, RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
    assert isinstance(made.robot.body.bus, MultiBus)
    alone = assemble(load_rig("maker"), RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
    assert not isinstance(alone.robot.body.bus, MultiBus)
    made.close()
    alone.close()
