"""Blender itself as judge: BLENDER_PYTHON names a Python with the package bpy."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from gazerig.config.schema import load_rig
from gazerig.features.animation.animation import joint_map
from gazerig.features.animation.animation_file import read_animation
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.description.gltf import gltf

PYTHON = os.environ.get("BLENDER_PYTHON", "")
DESK = load_rig("desk")
SCRIPT = """
import bpy, math, sys
source, result, moves = sys.argv[1], sys.argv[2], eval(sys.argv[3])
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps, scene.frame_start, scene.frame_end = 60, 0, 120
bpy.ops.import_scene.gltf(filepath=source)
for name, axis, frame, degrees in moves:
    joint = bpy.data.objects[name]
    joint.rotation_mode = "XYZ"
    joint.rotation_euler[axis] = math.radians(degrees)
    joint.keyframe_insert("rotation_euler", frame=frame)
bpy.ops.export_scene.gltf(filepath=result)
"""


def run_blender(source: Path, result: Path, moves: list[tuple[str, int, int, float]]) -> None:
    words = [PYTHON, "-c", SCRIPT, str(source), str(result), json.dumps(moves)]
    subprocess.run(words, check=True, capture_output=True, timeout=300)


@pytest.mark.skipif(not PYTHON, reason="BLENDER_PYTHON names no Python with bpy")
def test_blender_animates_the_model(tmp_path: Path) -> None:
    (tmp_path / "rig.glb").write_bytes(gltf(description_of(DESK)))
    # In Blender's local axes yaw turns about -y, pitch about -z and roll about x.
    moves = [
        *(("neck_yaw", 1, frame, -deg) for frame, deg in ((0, 0.0), (60, 30.0), (120, 0.0))),
        *(("neck_pitch", 2, frame, -deg) for frame, deg in ((0, 0.0), (60, -10.0), (120, 5.0))),
        *(("neck_roll", 0, frame, deg) for frame, deg in ((0, 0.0), (60, 8.0), (120, 0.0))),
    ]
    run_blender(tmp_path / "rig.glb", tmp_path / "moved.glb", moves)
    series = read_animation(tmp_path / "moved.glb", DESK, joint_map(DESK, [])).series
    for joint, ends in (("neck_yaw", (30, 0)), ("neck_pitch", (-10, 5)), ("neck_roll", (8, 0))):
        assert np.interp([1.0, 2.0], *series[joint]) == pytest.approx(ends, abs=0.01)
