"""Vectors, great circles and rotations, against values by hand and against numpy."""

from math import asin, pi, radians

import numpy as np

from gazerig.gaze import angles as a

V = (2.0, 3.0, -5.0)
M = ((2.0, 3.0, 5.0), (7.0, 11.0, 13.0), (17.0, 19.0, 23.0))
AHEAD = (1.0, 0.0, 0.0)
TURN = asin(0.8), asin(0.6), asin(12.0 / 13.0)
# Rz Ry Rx of these angles, whose sines and cosines are fractions.
TURNED = ((0.48, -0.64, 0.6), (0.64, -2.76 / 13.0, -9.6 / 13.0), (0.6, 9.6 / 13.0, 4.0 / 13.0))


def way(yaw_deg, pitch_deg=0.0):
    return a.direction((radians(yaw_deg), radians(pitch_deg)))


def same(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


def test_vectors_angles_and_numbers():
    same(a.unit((0.0, 0.0, 0.0)), AHEAD)
    same(a.perpendicular(V, (0.0, 0.6, 0.8)), (2.0, 3.0 + 2.2 * 0.6, -5.0 + 2.2 * 0.8))
    same([a.wrap(3.5 * pi), a.wrap(-1.0)], (-pi / 2, -1.0))
    same([a.clip(x, 2.0) for x in (-3.0, 1.5, 4.0)], (-2.0, 1.5, 2.0))
    same(a.direction(TURN[:2]), (0.48, 0.64, 0.6))


def test_a_point_is_moved_away_from_the_eye_only_if_it_is_too_near():
    near = a.add(V, (2.0, -3.0, 6.0))
    assert a.keep_min_distance(near, V, 7.0) is near
    same(a.keep_min_distance(near, V, 14.0), a.add(V, (4.0, -6.0, 12.0)))
    same(a.keep_min_distance(V, V, 2.0), a.add(V, (2.0, 0.0, 0.0)))


def test_a_great_circle_is_followed_extended_and_shortened():
    same(a.along_great_circle(way(10.0), way(70.0), 0.25), way(25.0))
    same(a.along_great_circle(AHEAD, (-1.0, 0.0, 0.0), 0.25), way(45.0))
    near = way(1e-8)
    assert [a.along_great_circle(AHEAD, near, part) for part in (0.49, 0.5)] == [AHEAD, near]
    same(a.offset_direction(way(30.0), AHEAD, radians(20.0), radians(10.0)), way(50.0, -10.0))
    assert a.offset_direction(near, near, 1.0, 1.0) is near
    far = a.scale(way(60.0), 3.0)
    same(a.shorten_arc(far, radians(20.0)), way(40.0))
    assert a.shorten_arc(far, radians(61.0)) == AHEAD == a.shorten_arc(V, a.angle_between(AHEAD, V))
    assert a.shorten_arc(near, -1.0, near) == near


def test_rotations_are_those_of_a_neck_and_of_an_axis():
    R = a.rotation(TURN)
    same(R, TURNED)
    same(a.angles_of(R), TURN)
    for sine, angle in ((1.0 + 1e-15, pi / 2), (-1.0 - 1e-15, -pi / 2)):
        assert a.angles_of((AHEAD, AHEAD, (sine, 0.0, 1.0)))[1] == angle
    same(a.rotate(M, V), np.array(M) @ V)
    same(a.rotate_back(M, V), V @ np.array(M))
    same(a.transpose(M), np.array(M).T)
    same(a.compose(M, TURNED), np.array(M) @ TURNED)
    # About the axis to which this rotation takes the x axis.
    axis, angle = (0.48, 0.64, 0.6), radians(50.0)
    about = np.array(TURNED) @ a.rotation((0.0, 0.0, angle)) @ np.array(TURNED).T
    same(a.turn_about(axis, angle), about)
    same(a.rotate_about_axis(V, axis, angle), about @ V)
