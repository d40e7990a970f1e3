"""Gaze points on the plane of a face."""

from math import cos, radians, sin

import pytest

from gazerig.gaze.angles import rotation, sub, unit

gaze_point_on_face = pytest.importorskip(
    "gazerig.features.lab.report.gaze_trace"
).gaze_point_on_face

NOSE = (1.0, 0.2, 0.25)
TOWARDS = rotation((radians(180.0), 0.0, 0.0))


@pytest.mark.parametrize("point", [(0.0, 0.0), (0.03, 0.035), (-0.05, -0.08)])
def test_a_line_of_sight_meets_the_face_where_it_is_aimed(point):
    y, z = point
    # The owner's left is the viewer's right: the face looks back along -x.
    place = (NOSE[0], NOSE[1] - y, NOSE[2] + z)
    eye = (0.0, 0.0, 0.2)
    assert gaze_point_on_face(eye, unit(sub(place, eye)), NOSE, TOWARDS) == pytest.approx(
        point, abs=1e-12
    )


def test_a_turned_face_is_met_on_its_own_plane():
    turned = rotation((radians(150.0), 0.0, 0.0))
    left = (-sin(radians(150.0)), cos(radians(150.0)), 0.0)
    place = (NOSE[0] + 0.03 * left[0], NOSE[1] + 0.03 * left[1], NOSE[2])
    eye = (0.0, 0.0, 0.2)
    met = gaze_point_on_face(eye, unit(sub(place, eye)), NOSE, turned)
    assert met == pytest.approx((0.03, 0.0), abs=1e-12)


def test_lines_along_the_plane_or_from_behind_meet_nothing():
    assert gaze_point_on_face((0.0, 0.0, 0.2), (0.0, 1.0, 0.0), NOSE, TOWARDS) is None
    assert gaze_point_on_face((2.0, 0.2, 0.25), (-1.0, 0.0, 0.0), NOSE, TOWARDS) is None
