"""Identities and velocities from picture to picture."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.types import Clothing, Located
from gazerig.gaze.types import FIRST_THING, body_name
from gazerig.robot.perception.track import BodyTrack
from gazerig.robot.perception.tracker import Tracker

CAMERA = (0.0, 0.0, 0.2)
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def face(x: float, y: float, kind: str = "face") -> Located:
    return Located(kind, (x, y, 0.2), IDENTITY if kind == "face" else None, 0.1, 0.0, 0.9)


@pytest.fixture
def tracker() -> Tracker:
    return Tracker()


def test_a_missed_picture_coasts_and_a_short_absence_keeps_the_identity(tracker):
    (seen,) = tracker.step([face(1.0, 0.0)], CAMERA, 0.0)
    assert [track.id for track in tracker.step([], CAMERA, 0.1)] == [seen.id]
    assert tracker.step([], CAMERA, 0.6) == ()
    assert tracker.step([face(1.0, 0.05)], CAMERA, 1.0)[0].id == seen.id


@pytest.mark.parametrize(
    ("y", "after_s", "same"), [(0.05, 10.0, True), (0.5, 10.0, False), (0.05, 25.0, False)]
)
def test_a_face_that_stays_where_it_was_is_known_again_after_long(
    tracker, monkeypatch, y, after_s, same
):
    monkeypatch.setattr("gazerig.robot.perception.tracker._REMEMBER_PERSON_S", 0.0)
    for k in range(10):
        (seen,) = tracker.step([face(1.0, 0.0)], CAMERA, k / 30)
    for k in range(10, round(30 * after_s)):
        assert k < 20 or tracker.step([], CAMERA, k / 30) == ()
    assert (tracker.step([face(1.0, y)], CAMERA, after_s)[0].id == seen.id) is same


def test_a_thing_out_of_sight_is_not_remembered(tracker):
    (hand,) = tracker.step([face(1.0, 0.0, "hand")], CAMERA, 0.0)
    assert tracker.step([], CAMERA, 3.0) == ()
    assert tracker.step([face(1.0, 0.0, "hand")], CAMERA, 3.1)[0].id != hand.id


def test_far_apart_is_somebody_else_and_kinds_never_mix(tracker):
    (one,) = tracker.step([face(1.0, 0.0)], CAMERA, 0.0)
    after = tracker.step([face(1.0, 0.6), face(1.0, 0.01, "hand")], CAMERA, 0.033)
    assert {track.detection.kind for track in after if track.id != one.id} == {"face", "hand"}


def across(y: float, x: float = 1.5, kind: str = "face") -> Located:
    return Located(
        kind,
        (x, y, 0.2),
        IDENTITY if kind == "face" else None,
        0.1,
        0.0,
        0.9,
        across_sd_m=0.002,
        along_sd_m=0.1,
    )


def test_an_identity_survives_a_second_behind_something(tracker):
    for k in range(30):
        (seen,) = tracker.step([across(0.4 * k / 30)], CAMERA, k / 30)
    for k in range(30, 60):
        assert tracker.step([], CAMERA, k / 30) == () or k < 40
    (back,) = tracker.step([across(0.4 * 2.0)], CAMERA, 2.0)
    assert back.id == seen.id


@pytest.mark.parametrize("apart_m", [0.0, 0.1, 0.4])
def test_people_who_cross_keep_their_identities(apart_m):
    """Two walk past each other at 1 m/s each; while one hides the other, one face is found."""
    rng, tracker = np.random.default_rng(3), Tracker()
    first: dict[str, int] = {}
    for k in range(91):
        t = k / 30
        left, right = 1.5 - t, t - 1.5
        ways = [across(left + rng.normal(0, 2e-3), 1.5), across(right, 1.5 + apart_m)]
        if abs(left - right) < 0.25:
            ways = ways[:1]
        tracks = tracker.step(ways, CAMERA, t)
        if k == 10:
            first = {"left": max(tracks, key=_y).id, "right": min(tracks, key=_y).id}
    assert {"left": min(tracks, key=_y).id, "right": max(tracks, key=_y).id} == first


def test_who_is_hidden_is_not_whoever_appears_nearby(tracker):
    """A man walks behind a woman; a third person appears half a metre from them."""
    near, far = across(0.0, 1.0), across(0.02, 2.0)
    for k in range(30):
        tracks = tracker.step([near, far], CAMERA, k / 30)
    after = tracker.step([near, across(0.5, 2.0)], CAMERA, 1.0)
    assert max(after, key=_y).id not in {track.id for track in tracks}
    # Nobody before him, and the same jump is his own.
    tracker = Tracker()
    for k in range(30):
        (alone,) = tracker.step([far], CAMERA, k / 30)
    (moved,) = tracker.step([across(0.5, 2.0)], CAMERA, 1.0)
    assert moved.id == alone.id


def test_what_the_detector_follows_stays_itself_beside_something_nearer(tracker):
    """A patch whose middle jumps by half a metre keeps the number that the detector gave it."""
    near, far = across(0.0, 1.9, "thing"), across(0.05, 2.0, "thing")
    near, far = near._replace(detector_id=1), far._replace(detector_id=2)
    for k in range(10):
        tracks = tracker.step([near, far], CAMERA, k / 30)
    jumped = far._replace(p_m=(2.0, 0.5, 0.2))
    after = tracker.step([near, jumped], CAMERA, 10 / 30)
    assert [track.id for track in after] == [track.id for track in tracks]


def _y(track: BodyTrack) -> float:
    return track.p_world_m[1]


def test_a_distance_known_badly_is_no_reason_to_be_somebody_else(tracker):
    (one,) = tracker.step([across(0.0, 3.0)], CAMERA, 0.0)
    (same,) = tracker.step([across(0.0, 3.4)], CAMERA, 0.033)
    assert same.id == one.id
    exact = Located("thing", (3.0, 0.0, 0.2), None, 0.1, 0.0, 0.9, along_sd_m=0.01)
    tracker = Tracker()
    (one,) = tracker.step([exact], CAMERA, 0.0)
    moved = exact._replace(p_m=(9.0, 0.0, 0.2))
    assert {track.id for track in tracker.step([moved], CAMERA, 0.033)} != {one.id}


def test_a_sudden_step_is_followed_at_once_and_standing_stays_smooth():
    """Quiet while nothing happens, lively when something does."""
    rng, tracker = np.random.default_rng(1), Tracker()
    lag, speeds = [], []
    for k in range(180):
        t = k / 30
        y = 0.5 * min(1.0, max(0.0, (t - 4.0) / 0.5))
        (track,) = tracker.step([across(y + rng.normal(0.0, 1e-3), 1.0)], CAMERA, t)
        lag.append(abs(track.p_world_m[1] - y))
        if 1.0 < t < 4.0:
            speeds.append(track.v_world_m_s[1])
    assert np.std(speeds) < 0.01
    assert max(lag) < 0.02


def test_the_size_of_a_face_is_learned_from_depth_and_used_in_its_holes(tracker):
    """A child's face looks 20 % farther than it is; through a hole it stays where it is."""
    by_depth = across(0.0, 1.0)._replace(depth_measured=True, along_sd_m=0.01, size_depth=1.25)
    for k in range(20):
        (track,) = tracker.step([by_depth], CAMERA, k / 30)
    assert track.depth_from == "camera" and track.face_size == pytest.approx(0.8)
    by_size = across(0.0, 1.25)
    for k in range(20, 40):
        (track,) = tracker.step([by_size], CAMERA, k / 30)
    assert track.depth_from == "face size"
    assert track.p_world_m[0] == pytest.approx(1.0, abs=0.01)


@given(
    st.lists(
        st.lists(
            st.tuples(
                st.floats(0.3, 5.0), st.floats(-3.0, 3.0), st.sampled_from(["face", "thing"])
            ),
            max_size=6,
        ),
        max_size=12,
    ),
    st.floats(0.001, 0.5),
)
def test_nothing_makes_it_give_what_is_no_number(pictures, dt_s):
    tracker, t_s = Tracker(), 0.0
    for picture in pictures:
        t_s += dt_s
        tracks = tracker.step([face(x, y, kind) for x, y, kind in picture], CAMERA, t_s)
        assert len({track.id for track in tracks}) == len(tracks) >= len(picture)
        for track in tracks:
            assert np.isfinite((track.p_world_m, track.v_world_m_s)).all()
            for known in track.filter.across, track.filter.along:
                assert known.p * known.v > known.pv * known.pv


def dressed(found: Located, *bins: int) -> Located:
    """Return the same in clothes of one colour or of several in equal parts."""
    colours = tuple(len(bins) ** -0.5 * (k in bins) for k in range(24))
    return found._replace(clothing=Clothing(colours, 1.0))


@pytest.mark.parametrize(("worn", "same"), [(3, True), (7, False)])
def test_who_returns_elsewhere_in_the_same_clothes_is_known_again(tracker, worn, same):
    for k in range(15):
        (gone,) = tracker.step([dressed(across(0.5, 2.0), 3)], CAMERA, k / 30)
    tracker.step([], CAMERA, 6.0)
    (back,) = tracker.step([dressed(across(-0.9, 2.0), worn)], CAMERA, 6.03)
    assert (back.id == gone.id) is same


def test_who_returns_after_the_time_of_memory_is_somebody_new(tracker):
    for k in range(15):
        (gone,) = tracker.step([dressed(across(0.5, 2.0), 3)], CAMERA, k / 30)
    tracker.step([], CAMERA, 30.0)
    for t_s, same in ((50.0, True), (400.0, False)):
        (back,) = tracker.step([dressed(across(0.5, 2.0), 3)], CAMERA, t_s)
        assert (back.id == gone.id) is same
        tracker.step([], CAMERA, t_s + 25.0)


def visit(tracker: Tracker, start_s: float, *found: Located) -> list[int]:
    """Show a person in consecutive frames, then no one for 2 s; return the numbers."""
    tracker.step([], CAMERA, start_s - 1.0)
    shown = [
        tracker.step([one], CAMERA, start_s + k / 30)[0].id for k, one in enumerate(found)
    ]  # fmt: skip
    tracker.step([], CAMERA, start_s + len(found) / 30 + 2.0)
    return shown


def test_people_and_things_count_separately(tracker):
    found = [across(0.5, kind="thing"), across(-0.5), across(0.0, kind="hand")]
    ids = [track.id for track in tracker.step(found, CAMERA, 0.0)]
    assert ids == [FIRST_THING, 1, FIRST_THING + 1]
    assert [body_name("hand", i) for i in ids] == ["hand 1", "hand 1", "hand 2"]


def test_a_person_who_comes_back_at_the_other_side_keeps_the_number(tracker):
    assert {*visit(tracker, 0.0, *[across(0.5)] * 15)} == {1}
    assert {*visit(tracker, 40.0, *[across(-0.9)] * 15)} == {1}
    taller = across(0.5)._replace(p_m=(1.5, 0.5, 0.6))
    assert {*visit(tracker, 80.0, *[taller] * 15)} == {2}


def test_nobody_is_faster_than_a_walker(tracker):
    visit(tracker, 0.0, *[across(0.0, 3.0)] * 15)
    far = across(0.0)._replace(p_m=(1.5, 20.0, 0.2))
    assert {*visit(tracker, 4.0, *[far] * 15)} == {2}


def test_clothes_that_are_seen_later_settle_the_number(tracker):
    visit(tracker, 0.0, *[dressed(across(0.5), 3)] * 15)
    stranger = visit(tracker, 30.0, across(0.4), *[dressed(across(0.4), 7)] * 15)
    assert stranger[0] == 1 and stranger[-1] == 2
    low = across(0.4)._replace(p_m=(1.5, 0.4, 0.0))
    known = visit(tracker, 60.0, low, *[dressed(low, 3)] * 15)
    assert known[0] != 1 and known[-1] == 1


def test_who_is_hidden_stays_as_high_and_goes_no_faster_than_people(tracker):
    for k in range(12):
        up = across(0.0, 2.0)._replace(p_m=(2.0, 0.2 * k, 0.2 + 0.03 * k))
        (one,) = tracker.step([up], CAMERA, k / 30)
    assert np.linalg.norm(one.v_world_m_s) <= 4.0
    before = one.p_world_m[2]
    for k in range(12, 18):
        tracker.step([], CAMERA, k / 30)
    assert one.p_world_m[2] == pytest.approx(before, abs=0.05)


def test_a_thing_that_turns_out_to_be_a_hand_keeps_its_identity(tracker):
    moving = face(2.0, 0.9, "thing")._replace(detector_id=7)
    (thing,) = tracker.step([moving], CAMERA, 0.0)
    hand = moving._replace(kind="hand", p_m=(0.6, 0.27, 0.2))
    other = face(1.0, -0.5, "hand")._replace(detector_id=8)
    found = {
        track.detection.detector_id: track for track in tracker.step([hand, other], CAMERA, 0.03)
    }
    assert found[7].id == thing.id != found[8].id
    assert found[7].p_world_m == pytest.approx(hand.p_m)
