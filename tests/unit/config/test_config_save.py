"""Values written into YAML: comments and order stay, and no failure loses anything."""

import shutil
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from present import present

from gazerig.config.load import ConfigError, load, read_yaml, shipped_path
from gazerig.config.save import format_value, propose, save
from gazerig.config.schema import Rig, load_rig
from gazerig.params import Bounds, Unit
from gazerig.robot.model.parameter import ParamChange

NOW = datetime(2026, 1, 31, 23, 59, 58)


@dataclass(frozen=True)
class Joint:
    id: Annotated[int, Bounds(0, 252), "servo id"] = 1
    zero_step: Annotated[int, Bounds(0, 4095), Unit("steps"), "at 0 deg"] = 2048
    min_deg: Annotated[float, Bounds(-180, 180), "lowest"] = -30.0
    gains: Annotated[tuple[int, int, int] | None, "P, I and D"] = None
    note: Annotated[str, " ".join(["long"] * 30)] = ""


@dataclass(frozen=True)
class Head:
    name: str = "a"
    joints: Annotated[dict[str, Joint], "one entry per joint"] = field(default_factory=dict)
    spare: Annotated[Joint, "one on the shelf"] = field(default_factory=Joint)


SMALL = """\
# a head
name: nod   # its name

joints:
    pan: {id: 1, zero_step: 2000}    # flow
    jaw:
        gains: null
    tilt:
        id: 2
        zero_step: 2048      # by hand, 3 May
        # the stop is soft
        min_deg: -35.0
        gains:
        - 400   # P
        - 0
        - 10    # D
# the end
"""


def check(path):
    return load(Path(path), Head)


@pytest.fixture
def small(tmp_path):
    file = tmp_path / "head.yaml"
    file.write_text(SMALL)
    return file


def put(path, changes, load_again=check):
    return save(path, changes, NOW, load_again)


def lines_that_differ(old, new):
    pairs = zip(old.splitlines(), new.splitlines(), strict=True)
    return [pair for pair in pairs if pair[0] != pair[1]]


def test_a_value_changes_and_every_other_line_stays(small):
    saved = put(small, {"joints.tilt.zero_step": 2051})
    assert lines_that_differ(SMALL, small.read_text()) == [
        (
            "        zero_step: 2048      # by hand, 3 May",
            "        zero_step: 2051      # by hand, 3 May",
        )
    ]
    assert saved.changes == (ParamChange("joints.tilt.zero_step", "2048", "2051"),)
    assert str(saved.changes[0]) == "joints.tilt.zero_step: 2048 -> 2051"
    assert saved.backup == small.with_name("head.yaml.bak-20260131-235958")
    assert present(saved.backup).read_text() == SMALL


def test_missing_keys_are_added_apart_from_the_comments_of_what_follows(small):
    saved = put(
        small,
        {"joints.pan.min_deg": -20.0, "spare.id": 9, "spare.note": "x", "joints.tilt.note": "y"},
    )
    text = small.read_text()
    assert "    pan: {id: 1, zero_step: 2000, min_deg: -20.0} # flow\n" in text
    assert '    tilt:\n        note: "y"\n        id: 2\n' in text
    assert text.endswith("        - 10    # D\n# the end\nspare: {id: 9, note: x}\n")
    assert saved.changes[1] == ParamChange("spare.id", None, "9")
    assert str(saved.changes[1]) == "spare.id: (not in the file) -> 9"
    assert check(small).spare.id == 9


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"joints.tilt.zero_step": 5000},
            r"head\.yaml:\d+: joints\.tilt\.zero_step: is 5000",
        ),
        ({"joints.tilt.min_deg": float("nan")}, "joints.tilt.min_deg"),
        ({"joints.tilt.min_degree": 1.0}, "min_degree: unknown key"),
        ({"joints.tilt": 1}, "joints.tilt: cannot be written: it is a mapping"),
        ({"name.x": 1}, "name: is {'x': 1}, wanted text"),
    ],
)
def test_a_refused_value_leaves_everything_as_it_was(small, changes, says):
    with pytest.raises(ConfigError, match=says):
        put(small, changes)
    assert small.read_text() == SMALL
    assert [p.name for p in small.parent.iterdir()] == ["head.yaml"]


def test_shipped_rigs_are_copied_not_changed(tmp_path):
    desk = shipped_path("rigs", "desk")
    before = desk.read_bytes()
    with pytest.raises(ConfigError, match=r"copy it \(cp .*desk\.yaml mydesk\.yaml\)"):
        save(desk, {"joints.neck_yaw.zero_step": 1}, NOW)
    mine = tmp_path / "mine.yaml"
    saved = save(mine, {"joints.neck_yaw.zero_step": 2050}, NOW, source=desk)
    assert saved.backup is None and desk.read_bytes() == before
    assert load_rig(str(mine)).joints["neck_yaw"].zero_step == 2050
    with pytest.raises(ConfigError, match="already exists"):
        save(mine, {}, NOW, source=desk)


def test_a_whole_rig(tmp_path):
    mine = Path(shutil.copy(shipped_path("rigs", "desk"), tmp_path / "mine.yaml"))
    wishes: dict[str, Any] = {
        "joints.neck_yaw.zero_step": 2051,
        "joints.neck_yaw.sign": -1,
        "joints.left_eye_pan.min_deg": -31.5,
        "joints.left_eye_pan.torque_limit": 0.5,
        "bus.port": "/dev/serial/by-id/usb-FTDI_USB__-__Serial-if00",
    }
    assert [c.key for c in propose(mine, wishes)[2]] == list(wishes)
    saved = save(mine, wishes, NOW)
    rig = load_rig(str(mine))
    assert isinstance(rig, Rig)
    assert (rig.joints["neck_yaw"].zero_step, rig.joints["neck_yaw"].sign) == (2051, -1)
    assert rig.joints["left_eye_pan"].torque_limit == 0.5
    old, new = present(saved.backup).read_text().splitlines(), mine.read_text().splitlines()
    assert len(new) - len(old) == len(set(new) - set(old)) - len(set(old) - set(new)) <= 2
    # A rule between two sections is checked before anything is replaced.
    before = mine.read_bytes()
    with pytest.raises(
        ConfigError, match=rf"{mine}:\d+: joints.left_eye_tilt.id: id 2 on bus is already"
    ):
        save(mine, {"joints.left_eye_pan.id": 2}, NOW)
    assert mine.read_bytes() == before


SCALARS = st.one_of(
    st.integers(-(10**6), 10**6),
    st.floats(allow_nan=False, allow_infinity=False, width=32),
    st.booleans(),
    st.none(),
    st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=12),
    st.sampled_from(
        ["yes", "No", "null", "1e3", "0x10", "~", "a: b", "a #b", "*a", "&a", "2026-01-31"]
    ),
)


@given(value=st.one_of(SCALARS, st.lists(SCALARS, max_size=3)))
@settings(max_examples=150)
def test_what_is_written_is_read_back(tmp_path_factory, value):
    path = tmp_path_factory.getbasetemp() / "written.yaml"
    path.write_bytes(f"a: {format_value(value)}\n".encode())
    read = read_yaml(path).data["a"]
    wanted = tuple(value) if isinstance(value, list) else value
    assert read == wanted and type(read) is type(wanted)


def test_somebody_elses_change_meanwhile_is_not_lost(small):
    def slow(path):
        small.write_text(SMALL + "spare: {id: 77}\n")
        return check(path)

    with pytest.raises(ConfigError, match="changed by another program"):
        put(small, {"name": "mine"}, slow)
    assert "id: 77" in small.read_text()


def test_flow_mappings_and_block_lists_keep_their_style(small):
    put(small, {"joints.pan.id": 7, "joints.tilt.gains": (800, 1, 10)})
    text = small.read_text()
    assert "    pan: {id: 7, zero_step: 2000}    # flow\n" in text
    assert "        - 800   # P\n        - 1\n        - 10    # D\n" in text
