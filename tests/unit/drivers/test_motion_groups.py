"""Moving pixels to things, and things to numbers that last."""

import numpy as np
import pytest

from gazerig.drivers.vision.motion.clustering import cluster_motion, inscribed_radius_px
from gazerig.drivers.vision.motion.segmentation import MotionMask
from gazerig.drivers.vision.motion.tracking import MotionTracks, PatchTrack

SHAPE = (240, 320)
Box = tuple[int, int, int, int]


def things(*boxes: tuple[Box, tuple[float, float]]) -> MotionMask:
    """Make boxes (x, y, width, height) that move as one each."""
    flow = np.zeros((*SHAPE, 2), dtype=np.float32)
    mask = np.zeros(SHAPE, dtype=np.bool_)
    for (x, y, width, height), motion in boxes:
        flow[y : y + height, x : x + width] = motion
        mask[y : y + height, x : x + width] = True
    return MotionMask(flow, mask, np.ones(SHAPE, np.float32))


def boxes(given: MotionMask) -> list[Box]:
    return [group.box for group in cluster_motion(given)]


def test_apart_is_two_and_near_is_one():
    far = things(((10, 10, 30, 40), (2, 0)), ((80, 10, 20, 40), (2, 0)))
    assert boxes(far) == [(10, 10, 30, 40), (80, 10, 20, 40)]
    near = things(((10, 10, 30, 40), (2, 0)), ((42, 10, 20, 40), (2, 0)))
    assert boxes(near) == [(10, 10, 52, 40)]


def test_people_who_pass_are_two_and_who_walk_together_are_one():
    passing = things(((50, 50, 30, 60), (3, 0)), ((80, 50, 30, 60), (-3, 0)))
    assert sorted(boxes(passing)) == [(50, 50, 30, 60), (80, 50, 30, 60)]
    together = things(((50, 50, 30, 60), (3, 0)), ((80, 50, 30, 60), (2.5, 0.3)))
    assert boxes(together) == [(50, 50, 60, 60)]


def test_what_turns_or_grows_is_one():
    given = things(((50, 50, 80, 80), (1, 0)))
    y, x = np.mgrid[0:240, 0:320] - 90.0
    for flow in (np.dstack((-0.2 * y, 0.2 * x)), np.dstack((0.2 * x, 0.2 * y))):
        one = given._replace(flow=flow.astype(np.float32))
        assert boxes(one) == [(50, 50, 80, 80)]


def test_specks_are_nothing_and_the_largest_come_first():
    given = things(*(((10 + 40 * k, 10, 5 + 3 * k, 10 + 3 * k), (2, 0)) for k in range(7)))
    assert [box[0] for box in boxes(given)] == [250, 210, 170, 130, 90, 50]
    assert boxes(things(((10, 10, 6, 6), (2, 0)))) == []


def follow(
    tracks: MotionTracks, k: int, *places: tuple[float, float], v: tuple[float, float] = (0, 0)
) -> list[PatchTrack]:
    return tracks.step(
        [np.array(place, dtype=float) for place in places],
        [np.array(v, dtype=float)] * len(places),
        [30.0] * len(places),
        np.eye(3),
        k * 0.1,
        0.1,
    )


def test_who_keeps_moving_keeps_the_number_and_two_are_not_mixed_up():
    tracks = MotionTracks()
    first = [f.id for f in follow(tracks, 0, (50, 50), (200, 50), v=(600, 0))]
    for k in range(1, 6):
        found = follow(tracks, k, (200 + 60 * k, 50), (50 + 60 * k, 50), v=(600, 0))
        assert [f.id for f in found] == first[::-1]
        assert all(tracks.is_confirmed(f) for f in found)


def test_first_sight_is_not_told_yet_and_a_flicker_never():
    tracks = MotionTracks()
    for k in range(6):
        found = follow(tracks, k, (50, 50), *(((200, 50),) if k % 2 == 0 else ()))
        assert tracks.is_confirmed(found[0]) == (k >= 1)
        assert not any(tracks.is_confirmed(f) for f in found[1:])


@pytest.mark.parametrize(("gap", "same"), [(4, True), (8, False)])
def test_who_pauses_is_remembered_for_a_while(gap, same):
    tracks = MotionTracks()
    (one,) = follow(tracks, 0, (50, 50))
    for k in range(1, gap):
        assert follow(tracks, k) == []
    (other,) = follow(tracks, gap, (52, 50))
    assert (one.id == other.id) == same


def test_the_largest_disc_within_a_patch_tells_how_thick_it_is():
    """An arm is as thick as it is wide, however long; small holes and the edge change nothing."""
    for left, thick in ((100, 12.0), (0, 12.0)):
        given = things(((left, 50, 90, 24), (2, 0)))
        given.mask[60:62, 20 + left : 22 + left] = False
        (arm,) = cluster_motion(given)
        assert inscribed_radius_px(arm, SHAPE) == pytest.approx(thick, abs=1.0)
    (corner,) = cluster_motion(things(((0, 0, 40, 30), (2, 0))))
    assert inscribed_radius_px(corner, SHAPE) > 25.0, "it goes on beyond both edges"
