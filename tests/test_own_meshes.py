"""A user's own meshes replace the program's; a bad one is reported with its line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import invoked

from gazerig.config.load import ConfigError
from gazerig.config.rig_files import AllowedFolder
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.rig_description import description_of, shape_of
from gazerig.robot.description.mesh_params import MeshParams
from gazerig.robot.description.mjcf import mjcf
from gazerig.robot.description.own_meshes import read_mesh

RIG = """name: mine
profile: robot
bus: {kind: dynamixel, port: /dev/ttyUSB0}
geometry:
  {pitch_axis_height_mm: 0, eyes_ahead_mm: 0, eyes_above_mm: 90, interocular_mm: 62}
joints:
  eyes_pan: {id: 1, model: xl330-m077, min_deg: -35, max_deg: 35, max_speed_deg_s: 600, max_accel_deg_s2: 45000}
  eyes_tilt: {id: 2, model: xl330-m077, min_deg: -30, max_deg: 30, max_speed_deg_s: 600, max_accel_deg_s2: 45000}
camera: {mount: base, position_mm: [10, 0, 140]}
meshes:
"""
LINE = RIG.count("\n") + 1


def _rig(folder: Path, mesh: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(RIG + mesh)
    return path


def _box(path: Path) -> None:
    import trimesh

    trimesh.creation.box((20.0, 40.0, 60.0)).export(path)


def test_an_stl_in_millimetres_is_shown_where_the_file_says(tmp_path: Path) -> None:
    import mujoco

    (tmp_path / "parts").mkdir()
    _box(tmp_path / "parts" / "skull.stl")
    path = _rig(
        tmp_path,
        "  head: {file: parts/skull.stl, position_mm: [-40, 0, 10], rotation_deg: [90, 0, 0]}\n",
    )
    description = description_of(load_rig(str(path)))
    (look,) = description.link("head").visuals
    points = look.painted().mesh.vertices @ np.array(look.R).T + look.p_m
    assert np.allclose(points.min(axis=0), (-0.06, -0.01, -0.02))
    assert np.allclose(points.max(axis=0), (-0.02, 0.01, 0.04))
    # Faces of a box stay flat.
    normals = look.painted().normals
    assert normals is not None and np.allclose(np.abs(normals).max(axis=1), 1.0, atol=1e-6)
    text = mjcf(description)
    model = mujoco.MjSpec.from_string(text.xml, assets=text.assets).compile()
    assert "head_own" in {model.geom(i).name for i in range(model.ngeom)}


def test_a_gltf_file_stands_upright(tmp_path: Path) -> None:
    import trimesh

    tall = trimesh.creation.box((0.1, 0.5, 0.2))  # y is up in glTF, and z towards the viewer
    tall.export(tmp_path / "tall.glb")
    painted = read_mesh(MeshParams(str(tmp_path / "tall.glb"), metres_per_unit=1.0))
    assert np.allclose(np.ptp(painted.mesh.vertices, axis=0), (0.1, 0.2, 0.5), atol=1e-6)
    assert trimesh.Trimesh(painted.mesh.vertices, painted.mesh.faces).volume > 0.0


@pytest.mark.parametrize(
    ("mesh", "key", "words"),
    [
        ("head: {file: none.stl}", "meshes.head.file", "no such file"),
        ("head: {file: torn.glb}", "meshes.head.file", "torn.glb"),
        ("head: {file: box.step}", "meshes.head.file", "export it as one of these"),
        ("haed: {file: box.stl}", "meshes.haed", "did you mean"),
    ],
)
def test_a_bad_mesh_is_told_with_line_and_cure(
    mesh: str, key: str, words: str, tmp_path: Path
) -> None:
    _box(tmp_path / "box.stl")
    (tmp_path / "torn.glb").write_bytes(b"nothing here")
    path = _rig(tmp_path, f"  {mesh}\n")
    done = invoked("check", str(path))
    assert done.code == 2 and len(done.err.splitlines()) == 1
    assert f"mine.yaml:{LINE}" in done.err and key in done.err and words in done.err


def test_a_mesh_that_went_away_is_one_clear_error(tmp_path: Path) -> None:
    rig = load_rig(str(_rig(tmp_path, "  head: {file: gone.stl}\n")))
    with pytest.raises(SetupError, match=r"meshes\.head\.file: .*gone\.stl.*correct the path"):
        description_of(rig)
    # A recorded run is shown without it.
    assert shape_of(rig, without_lost_meshes=True) == shape_of(replace(rig, meshes={}))


def test_the_page_may_name_meshes_in_its_folder_only(tmp_path: Path) -> None:
    folder = AllowedFolder(tmp_path)
    with pytest.raises(ConfigError, match="only files in"):
        folder.check_changes({"meshes.head.file": "/etc/passwd"})
    with pytest.raises(ConfigError, match="only files in"):
        folder.check_changes({"meshes": {"head": {"file": "/etc/passwd"}}})
