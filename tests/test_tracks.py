"""Identities and velocities from picture to picture."""

import numpy as np
import pytest

from robot.tracks import Sighting, Tracker, TrackParams, blended

CAMERA = (0.0, 0.0, 0.2)
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def face(x: float, y: float, kind: str = "face") -> Sighting:
    return Sighting(kind, (x, y, 0.2), IDENTITY if kind == "face" else None, 0.1, 0.0, 0.9)


def test_velocity_is_learned_and_the_lag_vanishes() -> None:
    tracker = Tracker(TrackParams())
    for k in range(60):
        t = k / 30
        (track,) = tracker.step([face(1.0, 0.3 * t)], CAMERA, t)
    assert track.v_world_m_s[1] == pytest.approx(0.3, abs=0.01)
    assert track.p_world_m[1] == pytest.approx(0.3 * t, abs=0.003)


def test_noise_in_distance_hardly_moves_the_place_across() -> None:
    rng, tracker = np.random.default_rng(0), Tracker(TrackParams())
    places = []
    for k in range(200):
        (track,) = tracker.step([face(1.0 + rng.normal(0, 0.08), 0.0)], CAMERA, k / 30)
        places.append(track.p_world_m)
    assert np.std([p[0] for p in places[30:]]) < 0.035
    assert max(abs(p[1]) for p in places) < 1e-3


def test_two_people_keep_their_identities_when_listed_in_any_order() -> None:
    tracker = Tracker(TrackParams())
    first = tracker.step([face(1.0, -0.3), face(1.0, 0.3)], CAMERA, 0.0)
    ids = {track.p_world_m[1] > 0: track.id for track in first}
    for k in range(1, 30):
        pair = [face(1.0, 0.3), face(1.0, -0.3)]
        tracks = tracker.step(pair if k % 2 else pair[::-1], CAMERA, k / 30)
        assert {track.p_world_m[1] > 0: track.id for track in tracks} == ids


def test_a_missed_picture_coasts_and_a_short_absence_keeps_the_identity() -> None:
    tracker = Tracker(TrackParams())
    (seen,) = tracker.step([face(1.0, 0.0)], CAMERA, 0.0)
    assert [track.id for track in tracker.step([], CAMERA, 0.1)] == [seen.id]
    assert tracker.step([], CAMERA, 0.6) == ()
    assert tracker.step([face(1.0, 0.05)], CAMERA, 1.0)[0].id == seen.id
    assert tracker.step([], CAMERA, 3.0) == ()
    assert tracker.step([face(1.0, 0.05)], CAMERA, 3.1)[0].id != seen.id


def test_far_apart_is_somebody_else_and_kinds_never_mix() -> None:
    tracker = Tracker(TrackParams())
    (one,) = tracker.step([face(1.0, 0.0)], CAMERA, 0.0)
    after = tracker.step([face(1.0, 0.6), face(1.0, 0.01, "hand")], CAMERA, 0.033)
    assert {track.sighting.kind for track in after if track.id != one.id} == {"face", "hand"}


def test_blended_rotations_stay_rotations() -> None:
    turned = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    middle = np.array(blended(IDENTITY, turned, 0.5))
    assert middle @ middle.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.degrees(np.arctan2(middle[1, 0], middle[0, 0])) == pytest.approx(45.0)
