"""Tracks from files of animation programs."""

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import invoked

from gazerig.config.schema import load_rig
from gazerig.config.tracks import load_track
from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import ImportedAnimation, Series, joint_map
from gazerig.gaze.track.track import LIMIT_SHARE
from gazerig.robot.description.links import Link, LinkJoint
from gazerig.robot.model.commands import Play
from gazerig.robot.run.rig_limits import limits, track_fit
from gazerig.robot.run.track_file import write_track


def table(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text)
    return path


def animation(path: Path, given: Sequence[str] = (), **options: Any) -> ImportedAnimation:
    from gazerig.features.animation.animation_file import read_animation

    rig = load_rig("desk")
    return read_animation(path, rig, joint_map(rig, given), **options)


def read(path: Path, fps: float | None = None) -> dict[str, Series]:
    return animation(path, fps=fps).series


WIDE = "time,neck_pitch,neck_yaw\n0,0,5\n0.5,-8,\n1.0,0,9\n"
LONG = "joint;time_s;angle\nneck_pitch;0;0\nneck_yaw;0;5\nneck_pitch;.5;-8\nneck_yaw;1;9\nneck_pitch;1;0\n"
FRAMES = "frame\tneck_pitch\tneck_yaw\n0\t0\t5\n12\t-8\t\n24\t0\t9\n"


EXCEL = "\ufeffsep=;\r\n;;\r\n" + WIDE.replace(",", ";").replace(".", ",").replace("\n", "\r\n")


@pytest.mark.parametrize("text", [WIDE, LONG, FRAMES, EXCEL, "# from\n\n" + WIDE])
def test_wide_and_long_tables_and_frame_numbers_are_the_same_track(desk_rig, text, tmp_path):
    path = tmp_path / "mine.yaml"
    reply = write_track(desk_rig, path, read(table(tmp_path, text), 24.0), "x")
    assert [(f.time_s, f.head_pitch_deg, f.head_yaw_deg) for f in load_track(path).frames] == [
        (0.5, -8.0, None),
        (1.0, 0.0, 4.0),
    ]
    assert reply.limited == "" and reply.duration_s == pytest.approx(1.4)


BAD = {
    "when,neck_yaw\n0,1\n": ":1: no column of times",
    "time,neck_yaw\n0,1\n0.5,nan\n": ":3: neck_yaw: 'nan' is not a number",
    "time,neck_yaw\n0,1\n0.5,2\n0.4,3\n": ":4: neck_yaw: 0.4 s is not after 0.5 s",
    "time,tail\n0,1\n1,5\n": "'tail' is no joint: rename it or add --map NAME=JOINT; joints of the rig: left_eye_pan",
    "time,neck_yaw,neck_yaw\n0,0,1\n": ":1: two columns are named 'neck_yaw': remove one",
}


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_bad_rows_are_named_with_their_line(desk_rig, text, tmp_path):
    with pytest.raises(SetupError) as caught:
        read(table(tmp_path, text))
    assert BAD[text] in str(caught.value)


def test_the_command_imports_a_table_for_a_rig(tmp_path):
    path = table(tmp_path, WIDE)
    words = ["import", "desk", str(path), "greet", "--folder", str(tmp_path)]
    done = invoked(*words)
    assert done.code == 0 and "greet.yaml: on desk greet takes 1.4 s" in done.err
    assert invoked(*words, "--force", "--map", "neck_yaw=-neck_yaw").code == 0
    assert "head_yaw_deg: -4.0" in (tmp_path / "greet.yaml").read_text()
    again = invoked(*words)
    assert again.code != 0 and "--force" in again.err
    wrong = invoked(*words[:3], "Greet!", *words[4:])
    assert wrong.code != 0 and "lower-case letters" in wrong.err


def glb(tree: dict[str, Any], binary: bytes = b"") -> bytes:
    """Return a binary glTF file, written by nothing of ours."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def clip(
    times: list[float],
    rotations: np.ndarray[Any, Any],
    interpolation: str = "LINEAR",
    node: str = "neck_yaw",
    **view: Any,
) -> bytes:
    """Return a file with one node and its rotations x, y, z, w."""
    clock, values = np.array(times, "<f4").tobytes(), rotations.astype("<f4").tobytes()
    a, n, more = len(clock), len(values), json.dumps(view)[1:-1]
    tree = f"""{{"asset": {{"version": "2.0"}}, "nodes": [{{"name": "{node}"}}],
      "buffers": [{{"byteLength": {a + n}}}],
      "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": {a}{", " * bool(more)}{more}}},
        {{"buffer": 0, "byteOffset": {a}, "byteLength": {n}}}],
      "accessors": [
        {{"bufferView": 0, "componentType": 5126, "count": {len(times)}, "type": "SCALAR"}},
        {{"bufferView": 1, "componentType": 5126, "count": {len(rotations)}, "type": "VEC4"}}],
      "animations": [{{"name": "wave",
        "channels": [{{"sampler": 0, "target": {{"node": 0, "path": "rotation"}}}}],
        "samplers": [{{"input": 0, "output": 1, "interpolation": "{interpolation}"}}]}}]}}"""
    return glb(json.loads(tree), clock + values)


def about(axis: str, degrees: list[float]) -> np.ndarray[Any, Any]:
    half = np.radians(degrees) / 2.0
    vector = np.outer(np.sin(half), np.eye(3)["xyz".index(axis)])
    return np.column_stack([vector, np.cos(half)])


def read_bytes(
    data: bytes, folder: Path, name: str = "wave.glb", **options: Any
) -> ImportedAnimation:
    (folder / name).write_bytes(data)
    return animation(folder / name, **options)


def test_gltf_rotations_become_joint_angles(tmp_path):
    from scipy.spatial.transform import Rotation

    times, angles = [0.0, 0.5, 1.0], [0.0, 150.0, 250.0]
    # A quaternion and its negative are the same rotation.
    for signs in ([[1.0]] * 3, [[1.0], [-1.0], [1.0]]):
        yaw = read_bytes(clip(times, about("z", angles) * signs), tmp_path).series["neck_yaw"]
        assert yaw[1] == pytest.approx(angles, abs=1e-4) and yaw[0] == pytest.approx(times)
    # Pitch is positive upwards: about -y. Blender adds .001 to a name in use.
    pitch = clip(times, about("y", [0.0, 8.0, 0.0]), node="neck_pitch.001")
    assert read_bytes(pitch, tmp_path).series["neck_pitch"][1][1] == pytest.approx(-8.0, abs=1e-4)
    both = Rotation.from_quat(about("z", [0.0, 20.0, 0.0])) * Rotation.from_quat(
        about("x", [0.0, 5.0, 0.0])
    )
    found = read_bytes(clip(times, np.asarray(both.as_quat())), tmp_path)
    assert found.series["neck_yaw"][1][1] == pytest.approx(20.0, abs=1e-3)
    assert "5.0 deg about other axes (at 0.50 s)" in found.notes[0]


def test_angles_are_relative_to_the_rest_pose_of_a_node():
    from scipy.spatial.transform import Rotation

    from gazerig.features.animation.gltf_reader import joint_angles

    rest = Rotation.from_rotvec([0.3, -0.8, 0.4])
    axis = (0.6, 0.0, 0.8)
    link = Link(
        "nose", "head", R=rest.as_matrix().tolist(), joint=LinkJoint("nose", axis, -1, 1, 1, 1)
    )
    wanted = np.array([0.0, 25.0, -40.0])
    turned_to = rest * Rotation.from_rotvec(np.outer(wanted, axis), degrees=True)
    angles, off = joint_angles(link, turned_to.as_quat())
    assert angles == pytest.approx(wanted, abs=1e-9) and off.max() < 1e-5


def test_gltf_splines_are_read(tmp_path):
    from scipy.spatial.transform import Rotation

    keys = np.stack([about("z", angles) for angles in ([4.0, 2.0, 0.0], [0.0, 20.0, 0.0],
                                                       [6.0, -2.0, 0.0])], axis=1)  # fmt: skip
    keys[:, ::2, 3] = 0.0  # tangents: before a key and after it
    data = clip([0.0, 2.0, 4.0], keys.reshape(-1, 4), "CUBICSPLINE")
    at, curve = read_bytes(data, tmp_path).series["neck_yaw"]
    # A quarter of the way of 2 s from the first key to the second: weights of Hermite.
    weights = np.array([[0.84375, 2.0 * 0.140625], [0.15625, -2.0 * 0.046875]])
    mixed = weights[0] @ keys[0, 1:] + weights[1] @ keys[1, 1::-1]
    expected = Rotation.from_quat(mixed).as_euler("ZYX", degrees=True)[0]
    assert np.interp(0.5, at, curve) == pytest.approx(expected, abs=1e-3)


GOOD = clip([0.0, 0.5, 1.0], about("z", [0.0, 5.0, 0.0]))
NAN = about("z", [0.0, 5.0, 0.0]) * [[1.0], [np.nan], [1.0]]
BAD_FILES: dict[str, tuple[bytes, str]] = {
    "header.glb": (GOOD[:16], "is truncated: 16 bytes"),
    "half.json": (b'[{"Anim', "Input data was truncated: it is truncated or not a JSON export"),
    "still.glb": (glb({"asset": {"version": "2.0"}}), "no animation: bake constraints"),
    "text.gltf": (b"{}", "is no GLB: export glTF as .glb"),
    "steps.glb": (clip([0.0, 1.0], NAN[[0, 0]], "STEP"), "'STEP', but servos cannot step"),
    "nan.glb": (clip([0.0, 0.5, 1.0], NAN), "wave, neck_yaw: key 1 is not a number"),
    "tail.glb": (
        clip([0.0, 1.0], NAN[[0, 0]], node="tail"),
        "moves no joint of desk: left out: tail rotation (no joint): rename it",
    ),
    "packed.glb": (
        clip([0.0, 1.0], NAN[[0, 0]], extensions={"EXT_meshopt_compression": {}}),
        "accessors[0]: compressed by meshopt; export without compression",
    ),
    "years.glb": (clip([0.0, 2e9], NAN[[0, 0]]), "it takes 2e+09 s; at most 14400 s are read"),
    "pin.json": (
        b'[{"Animations": [{"Animation Name": "a", "Animation Commands": "sC,3,0,9,1,1,0,1,1,0"}]}]',
        "effector '3' is no joint: rename it or add --map NAME=JOINT; joints of the rig: left_eye",
    ),
    "words.json": (
        b'[{"Animations": [{"Animation Name": "a", "Animation Commands": "sC,3,0,9,1,x"}]}]',
        "a, command 1: 'sC,3,0,9,1,x' is not sC,effector and eight numbers",
    ),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_is_one_message_with_place_and_remedy(name, tmp_path):
    data, message = BAD_FILES[name]
    with pytest.raises(SetupError) as caught:
        read_bytes(data, tmp_path, name)
    text = str(caught.value)
    assert text.startswith(f"{tmp_path / name}") and message in text and "\n" not in text


def test_positions_of_the_blender_add_on_are_those_of_the_servos(desk_rig, tmp_path):
    joint = desk_rig.joints["neck_yaw"]
    steps = [joint.steps(np.radians(angle)) for angle in (0.0, 12.0, -7.0)]
    file = {"fps": 24, "frames": 3, "servos": {"7": {"name": "neck_yaw", "positions": steps}}}
    times, angles = read_bytes(json.dumps(file).encode(), tmp_path, "a.json").series["neck_yaw"]
    assert times == pytest.approx([0.0, 1 / 24, 2 / 24])
    assert angles == pytest.approx([0.0, 12.0, -7.0])
    file["servos"] = {"7": {"name": "Bone", "positions": [90, 100, 80]}}
    found = read_bytes(
        json.dumps(file).encode(), tmp_path, "a.json", given=["Bone=-neck_yaw"], centre_deg=90.0
    )
    assert found.series["neck_yaw"][1] == pytest.approx([0.0, -10.0, 10.0])


BOTTANGO = """sC,neck_yaw,0,800,4096,300,0,6144,-200,500,h99
sC,neck_yaw,800,600,6144,100,0,2048,-300,0,h99
sCO,neck_yaw,900,1,h99
sC,neck_yaw,1600,300,2048,0,0,8192,0,0,h99
sCT,neck_yaw,1700,h99
sC,neck_yaw,1750,100,4096,0,0,4096,0,0,h99
"""
PLACES = """
0 0.5  100 0.5106  200 0.539  400 0.6288
600 0.7246  750 0.7579  800 0.75  900 0.664  1000 0.5319  1150 0.3642  1300 0.2685  1400 0.25
1500 0.25  1599 0.25  1600 0.25  1700 0.5  1740 0.6  1750 0.5  1850 0.5
"""
"""Times in ms and places, 0..1, on the curves of BezierCurve.py of EvanBottango/Bottango.

Between curves the last place is held; a curve ends where the next one begins.
"""


def test_curves_of_bottango_have_the_handles_of_its_driver(desk_rig, tmp_path):
    file = [{"Animations": [{"Animation Name": n, "Animation Commands": BOTTANGO} for n in "ab"]}]
    with pytest.raises(SetupError, match="several animations: add --clip NAME with one of: a, b"):
        read_bytes(json.dumps(file).encode(), tmp_path, "b.json")
    found = read_bytes(json.dumps(file).encode(), tmp_path, "b.json", clip="b")
    at, places = np.array(PLACES.split(), float).reshape(-1, 2).T
    joint = desk_rig.joints["neck_yaw"]
    angles = joint.min_deg + places * (joint.max_deg - joint.min_deg)
    assert np.interp(at / 1e3, *found.series["neck_yaw"]) == pytest.approx(angles, abs=0.1)
    assert found.notes == ("2 on/off, trigger and colour events are left out",)


def test_an_imported_pose_is_owned_and_begins_and_ends_within_the_limits(desk_rig, tmp_path):
    times = [0.0, 1.0, 2.0]
    (tmp_path / "far.glb").write_bytes(clip(times, about("z", [40.0, -20.0, 30.0])))
    done = invoked("import", "desk", str(tmp_path / "far.glb"), "--folder", str(tmp_path))
    assert done.code == 0 and "for neck_yaw" in done.err
    track = load_track(tmp_path / "far.yaml")
    assert track.owns == ("neck_yaw",)
    motion = track_fit(desk_rig).motion(track, limits(desk_rig.joints), Play("far"))
    lead_s = 0.02 - motion.position_at(0.0)
    yaw = np.degrees(motion.curves.sample(np.array(times) + lead_s)[0, :, 0])
    assert yaw == pytest.approx([40.0, -20.0, 30.0], abs=1e-3)
    most = LIMIT_SHARE * desk_rig.joints["neck_yaw"].limit().accel_rad_s2
    every = motion.curves.sample(np.arange(0.0, motion.duration_s, 0.001))
    assert np.abs(every[2, :, 0]).max() < 1.002 * most and lead_s < 1.0


def test_a_table_moves_the_head_and_the_eyes_stay_on_their_target(desk_rig, tmp_path):
    path = table(tmp_path, "time,neck_yaw,left_eye_pan\n0,0,0\n0.5,8,-8\n1.2,0,0\n")
    write_track(desk_rig, tmp_path / "nod.yaml", read(path), "x")
    frames = load_track(tmp_path / "nod.yaml").frames
    assert [frame.head_yaw_deg for frame in frames] == [8.0, 0.0]
    assert [frame.eyes_yaw_deg for frame in frames] == [None, None]  # the line of sight
