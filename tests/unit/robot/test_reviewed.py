"""Numbers of descriptions and of poses of faces, all of them as they were reviewed."""

import re

import numpy as np
import pytest
from described_rigs import shipped
from posed_faces import CAMERA, turned
from present import present
from reviewed import assert_reviewed
from text_table import rows

from gazerig.robot.description.export import mjcf, urdf
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.face_pose import face_pose
from gazerig.robot.run.rig_description import description_of

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")


@pytest.mark.parametrize("name", ["expressive", "minimal"])
def test_every_number_of_a_description(name):
    """In thousandths: millimetres, grams and milliradians."""
    description = description_of(shipped(name))
    lines = (mjcf(description).xml + urdf(description).xml).splitlines()
    found = [[1e3 * float(x) for x in NUMBER.findall(line)] for line in lines]
    assert_reviewed(f"described-{name}", found)


POSES = """
# turns left and up and to the side in deg | to the right and distance in m | length of the face
0 0 0 0 0.5 1, 30 -10 20 0.1 0.6 1, -20 15 -30 -0.1 1 1.1, 10 20 5 0.2 2 0.9, -35 5 10 0 3 1
"""


def test_every_number_of_a_pose_of_a_face():
    """In thousandths: place, axes, length and error of the turn."""
    numbers = []
    for *turns, x, z, length in rows(POSES.replace(",", "\n")):
        face_m = LANDMARKS_FACE_M * (1.0, 1.0, length) @ turned(*np.radians(turns)).T
        pose = present(face_pose(project(face_m + (x, 0.5 * x, z), CAMERA), CAMERA))
        found = *pose.p_camera_m, *np.ravel(pose.R_camera_face), pose.length, pose.turn_sd_rad
        numbers.append([1e3 * float(value) for value in found])
    assert_reviewed("face-poses", numbers)
