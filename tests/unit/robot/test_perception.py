"""From detections to a percept: distances, whose motion is whose, what the head's turn leaves."""

from dataclasses import replace
from math import sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from seen_people import HEIGHT, LENS, STILL, WIDTH, face_at, seen

from gazerig.drivers.types import Clothing, DetectedPerson, MovingBlob
from gazerig.gaze.types import Vec3
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.perception import Perception

pytestmark = pytest.mark.usefixtures("still_people_count")


def depth_of(face_m: float, wall_m: float = 3.0, width: int = 60) -> NDArray[np.float32]:
    """Return a wall and before it, in the middle, a face's surface 2.5 cm behind its nose."""
    depth = np.full((HEIGHT, WIDTH), wall_m, np.float32)
    depth[140:260, 320 - width : 320 + width] = face_m + 0.0248
    return depth


def test_a_face_is_as_far_as_the_camera_measures_and_says_so():
    """A child's face of 0.8 at 0.8 m has the picture of an adult's at 1 m."""
    perception = Perception(STILL, 69.0)
    child = face_at((0.0, 0.0, 0.8), size=0.8)
    (face,) = seen(perception, 1, faces=(child,), depth_m=depth_of(0.8)).faces
    assert face.distance_from == "camera"
    assert face.p_world_m == pytest.approx((0.8, 0.0, 0.0), abs=0.01)
    assert 0.0 < face.along_sd_m < 0.02
    # Its parts are at the places of a face of that size.
    left_eye = np.subtract(face.parts_world_m[2], face.p_world_m)
    assert left_eye[1] == pytest.approx(-0.8 * PARTS_FACE_M["LE"][1], abs=0.002)


@pytest.mark.parametrize(
    ("size", "depth_m", "believed"),
    [
        (1.0, depth_of(1.7), False),  # background behind a narrow face
        (1.0, depth_of(0.6), False),  # a hand before the face
        (1.0, depth_of(9.0), False),  # far behind
        (1.0, depth_of(1.0, 1.7, width=10), True),  # background beside the face
        (0.65, depth_of(0.65), True),  # a child
        (1.3, depth_of(1.3), True),
        (1.0, np.random.default_rng(1).normal(1.0, 0.3, (HEIGHT, WIDTH)), False),  # no surface
        (1.0, None, False),
    ],
)
def test_depth_that_is_not_the_faces_is_not_taken(size, depth_m, believed):
    """All have the picture of an adult's face at 1 m."""
    perception = Perception(STILL, 69.0)
    face = face_at((0.0, 0.0, size), size)
    (found,) = seen(perception, 1, faces=(face,), depth_m=depth_m).faces
    assert found.distance_from == ("camera" if believed else "face size")
    assert found.p_world_m[0] == pytest.approx(size, abs=0.02)
    assert believed or found.along_sd_m > 0.05


def blob_at(p: Vec3, v: Vec3, known: bool = True, **more: Any) -> MovingBlob:
    made = MovingBlob(
        1, "thing", p, 0.2, v_camera_m_s=v, depth_known=known, depth_sd_m=0.05 if known else 1.0
    )
    return replace(made, box_px=(0.0, 0.0, 10.0, 10.0), **more)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_no_number_is_not_taken_in(bad):
    perception = Perception(STILL, 69.0)
    blobs = (
        MovingBlob(1, "thing", (bad, 0.0, 1.0), 0.1),
        MovingBlob(2, "thing", (0.0, 0.0, 1.0), bad),
        blob_at((0.5, 0.0, 1.0), (bad, 0.0, 0.0), loom_sd_1_s=bad),
        replace(blob_at((-0.5, 0.0, 1.0), (0.1, 0.0, 0.0)), spin_rad_s=bad, depth_sd_m=bad),
    )
    wrong = replace(face_at((0.0, 0.0, 1.0)), landmarks_px=np.full((5, 2), bad))
    bodies = seen(perception, 1, faces=(wrong,), blobs=blobs).bodies
    assert bodies.kinds == ()


def test_who_walks_out_of_the_picture_is_no_longer_seen_but_remembered():
    """A body without a visible face is reported for a second after it was found, inside."""
    perception, outside = Perception(STILL, 69.0), 0
    ids: set[int] = set()
    for k in range(1, 90):
        x = -0.6 + 2.0 * k / 30  # the picture ends at 1.37 m
        inside = x < 1.3
        body = body_at(x)
        found = seen(perception, k, people=(body,) if inside else ())
        ids |= set(found.bodies.ids)
        places = found.bodies.p_world_m
        outside += sum(abs(y / x) > WIDTH / 2.0 / LENS.fx_px for x, y, _ in places)
        assert bool(len(places)) or not inside
    assert outside == 0 and len(ids) == 1
    assert set(seen(perception, 91, people=(body_at(1.3),)).bodies.ids) == ids


@pytest.mark.parametrize(("frames", "waited"), [(1, False), (2, True)])
def test_a_body_that_is_found_once_is_not_waited_for_as_a_person_is(frames, waited):
    perception = Perception(STILL, 69.0)
    for k in range(1, 25):
        found = seen(perception, k, people=(body_at(0.4),) if k <= frames else ())
    assert bool(found.bodies.ids) is waited


def body_at(x: float) -> DetectedPerson:
    """Return a person 2 m away who is turned away, somewhat to the right."""
    ((x_px, y_px),) = project([(x, 0.0, 2.0)], LENS).tolist()
    worn = Clothing((1.0, *[0.0] * 23), 1.0)
    return DetectedPerson((0.0, 0.0, 1.0, 1.0), (x_px, y_px), 193.0, 0.9, worn)


@pytest.mark.parametrize("sway_m", [0.0, 0.003])
def test_the_sway_of_who_stands_is_life_and_the_noise_of_a_photo_is_none(sway_m):
    perception, rng, shown = Perception(STILL, 69.0), np.random.default_rng(1), []
    for k in range(1, 1000):
        face = face_at((sway_m * sin(0.06 * k), 0.0, 1.5))  # 0.3 Hz
        points = face.landmarks_px + rng.normal(0.0, 0.5, (5, 2))
        found = seen(perception, k, faces=(replace(face, landmarks_px=points),))
        shown.append(not found.bodies.lifeless)
    assert shown[90] and abs(np.mean(shown[180:]) - (sway_m > 0.0)) < 0.1


@pytest.mark.parametrize("sway_m", [0.0, 0.5])
def test_who_has_walked_in_is_a_person_for_a_while_and_a_bottle_is_none(sway_m):
    perception, counted = Perception(STILL, 69.0), 0
    for k in range(1, 900):
        people = (body_at(sway_m * min(k / 30.0, 1.0)),) if k % 15 == 1 else ()
        counted += len(seen(perception, k, people=people).bodies)
    assert counted == pytest.approx(1200.0 * sway_m, abs=60)


def test_a_face_that_jumps_again_and_again_is_in_a_film():
    perception = Perception(STILL, 69.0)
    for k in range(1, 300):
        places = 0.1 + k // 60 % 2 / 5, 0.02 * sin(0.2 * k) - 1.0
        faces = tuple(face_at((x, 0.0, 2.0)) for x in places)
        found = seen(perception, k, faces=faces)
    assert found.bodies.lifeless == found.bodies.ids[:1]


def test_a_face_that_is_measured_badly_for_a_moment_is_in_no_film():
    perception = Perception(STILL, 69.0)
    for k in range(1, 60):
        x = 0.15 * (k % 2) if 30 <= k < 36 else 0.02 * sin(0.2 * k)
        found = seen(perception, k, faces=(face_at((x, 0.0, 2.0)),))
    assert found.bodies.lifeless == ()


def test_a_face_before_a_wall_lives_and_one_in_its_plane_does_not():
    for face_m, lifeless in ((2.0, ()), (2.98, (1,))):
        perception = Perception(STILL, 69.0)
        for k in range(1, 30):
            faces = (face_at((0.02 * sin(0.2 * k), 0.0, face_m)),)
            found = seen(perception, k, faces=faces, depth_m=depth_of(face_m, width=30))
        assert found.bodies.lifeless == lifeless


def test_nothing_is_seen_where_the_rig_ignores_what_is_there():
    camera = CameraParams(mount="base", ignore_deg=((-30.0, -10.0, -20.0, 20.0),))
    faces = face_at((0.7, 0.0, 2.0)), face_at((-0.7, 0.0, 2.0))  # 19 deg to the right and left
    (found,) = seen(Perception(CameraMount(camera), 69.0), 1, faces=faces).faces
    assert found.p_world_m[1] > 0.0
