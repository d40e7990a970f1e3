"""Identities end at a cut of a film; pans, switched light, saccades and crossings end none."""

from math import radians

import numpy as np
import pytest
from present import present
from seeing import row_09_identities as row
from seen_people import Neck, face_at

from gazerig.drivers.types import SCENES_OF_A_PROCESS, Detections
from gazerig.drivers.vision.cut_detector import CutDetector
from gazerig.gaze.types import Percept
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.perception.perception import Perception


@pytest.mark.parametrize("seed", [0, 5])
def test_e89_cuts_are_found_identities_end_there_and_nothing_else_is_one(seed):
    """Among pans, light that is switched off and on, noise and a hand before the lens."""
    rng = np.random.default_rng(seed)
    images, cuts = row.cut_film(rng)
    assert row.cuts_in(images) == row.ends_in(images, rng) == cuts == [24, 48, 72]


def test_a_covered_lens_shows_the_same_scene_afterwards():
    rng, cuts = np.random.default_rng(1), CutDetector()
    room, black = row.room(rng), np.zeros((400, 640, 3), np.uint8)
    assert [cuts.scene(image) for image in (room, black, black, room)] == [0, 0, 0, 0]
    assert [cuts.scene(image) for image in (black, row.room(rng))] == [0, 1]


def turned(*frames: tuple[float, int, int]) -> list[Percept]:
    """See a face ahead of a head at yaws (deg), with the scene and the starts of the camera."""
    mount = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
    perception, poses, percepts = (
        Perception(mount, 69.0), PoseHistory(Neck()), []
    )  # fmt: skip
    for number, (yaw_deg, scene, starts) in enumerate(frames, start=1):
        yaw = radians(yaw_deg)
        poses.remember(number / 30, (yaw, 0.0, 0.0))
        face = face_at((np.sin(yaw), 0.0, np.cos(yaw)))
        found = Detections(
            number / 30, number, 640, 400, (face,), scene=scene + starts * SCENES_OF_A_PROCESS
        )
        percepts.append(present(perception.see(found, poses)))
    return percepts


@pytest.mark.parametrize(("turned_deg", "ends"), [(0.0, True), (2.0, True), (30.0, False)])
def test_a_head_that_turned_sees_another_part_of_the_same_room(turned_deg, ends):
    """Pictures of a saccade are as unlike as those about a cut; the joints distinguish them."""
    percepts = turned((0.0, 0, 0), (0.0, 0, 0), (turned_deg, 1, 0))
    ids = [[face.id for face in percept.faces] for percept in percepts]
    assert ids[0] == ids[1] and len(ids[2]) == 1
    assert (ids[2] != ids[1]) is ends


def test_a_camera_process_that_was_started_again_shows_another_scene():
    """Each process counts from 0; a turn of the head meanwhile is no saccade."""
    percepts = turned((0.0, 2, 0), (0.0, 0, 1), (0.0, 0, 1), (30.0, 0, 2))
    ids = [percept.faces[0].id for percept in percepts]
    assert ids[1] == ids[2] and len({*ids}) == 3
    assert [percept.scene for percept in percepts] == [0, 1, 1, 2]
