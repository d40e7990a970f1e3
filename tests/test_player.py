"""The player plays, waits, leaps and steps by the clock it is given."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.robot.dashboard.feed.page_process import SPEEDS
from gazerig.robot.recording.playback import STEPS, Mark, PlaybackClock

MARKS = (
    Mark(1.0, "saccade", "saccade to face"),
    Mark(1.5, "event", "asked: stop"),
    Mark(2.0, "saccade", "saccade to face"),
    Mark(2.0, "blink", "blink"),
    Mark(7.5, "saccade", "saccade to hand"),
)


def made() -> PlaybackClock:
    return PlaybackClock(10.0, MARKS)


def at(player: PlaybackClock, now_s: float) -> float:
    return player.state(now_s).at_s


@pytest.fixture
def player() -> PlaybackClock:
    return made()


def test_it_stands_at_the_beginning_until_it_is_asked_to_play(player: PlaybackClock) -> None:
    assert player.state(100.0) == (0.0, 10.0, False, 1.0, None)
    player.play(100.0)
    assert at(player, 103.0) == pytest.approx(3.0)
    player.pause(103.0)
    assert at(player, 200.0) == pytest.approx(3.0) and not player.state(200.0).playing
    player.play(200.0)
    assert at(player, 200.5) == pytest.approx(3.5)


def test_another_speed_holds_from_now_on(player: PlaybackClock) -> None:
    player.play(0.0)
    player.set_speed(0.25, 2.0)
    assert at(player, 2.0) == pytest.approx(2.0)
    assert at(player, 6.0) == pytest.approx(3.0)
    player.set_speed(4.0, 6.0)
    assert at(player, 7.0) == pytest.approx(7.0)


@pytest.mark.parametrize("speed", [0.0, -1.0, 9.0, float("nan"), float("inf")])
def test_a_speed_outside_is_refused_and_changes_nothing(
    player: PlaybackClock, speed: float
) -> None:
    player.play(0.0)
    with pytest.raises(ValueError, match="is not between 0.05 and 8"):
        player.set_speed(speed, 1.0)
    assert at(player, 2.0) == pytest.approx(2.0) and player.state(2.0).speed == 1.0


def test_it_stops_at_the_end_and_begins_anew_from_there(player: PlaybackClock) -> None:
    player.play(0.0)
    assert player.state(11.0)[:3] == (10.0, 10.0, False)
    assert at(player, 20.0) == 10.0
    player.play(20.0)
    assert at(player, 21.0) == pytest.approx(1.0)


def test_seeking_goes_on_playing_from_there_and_stays_inside(player: PlaybackClock) -> None:
    player.play(0.0)
    player.seek(6.0, 1.0)
    assert at(player, 2.0) == pytest.approx(7.0) and player.state(2.0).sought_s == 6.0
    player.seek(-3.0, 2.0)
    assert at(player, 2.0) == 0.0
    player.seek(99.0, 3.0)
    assert at(player, 3.0) == 10.0


def test_seeking_back_from_the_end_waits_there(player: PlaybackClock) -> None:
    player.play(0.0)
    player.seek(4.0, 15.0)  # no one looked since it ended
    assert player.state(16.0)[:3] == (4.0, 10.0, False)


def test_steps_go_from_one_to_the_next_and_stand_still(player: PlaybackClock) -> None:
    player.play(0.0)
    places = []
    for step in ("next saccade", "next saccade", "next saccade", "previous saccade"):
        player.step(step, 0.5)
        places.append(at(player, 60.0))
        assert not player.state(60.0).playing
    assert places == [1.0, 2.0, 7.5, 2.0]
    player.step("previous event", 61.0)
    assert at(player, 61.0) == 1.5
    player.step("next blink", 61.0)
    assert at(player, 61.0) == 2.0


def test_no_further_step_says_so_and_stays(player: PlaybackClock) -> None:
    player.seek(8.0, 0.0)
    with pytest.raises(ValueError, match="there is no next saccade"):
        player.step("next saccade", 0.0)
    with pytest.raises(ValueError, match="unknown step 'sideways'; available: previous saccade"):
        player.step("sideways", 0.0)
    assert at(player, 0.0) == 8.0


def test_what_the_page_asks_for_is_done(player: PlaybackClock) -> None:
    player.handle_request({"seek_s": 2}, 0.0)
    player.handle_request({"speed": 2.0}, 0.0)
    player.handle_request({"play": True}, 0.0)
    assert player.state(1.0)[:4] == (4.0, 10.0, True, 2.0)
    player.handle_request({"play": False}, 1.0)
    player.handle_request({"step": "next saccade"}, 1.0)
    assert player.state(9.0)[:3] == (7.5, 10.0, False)


@pytest.mark.parametrize(
    "asked",
    [None, {}, [], "play", {"play": 1}, {"seek_s": "2"}, {"seek_s": True}, {"seek_s": None},
     {"step": 3}, {"rewind": True}, {"play": True, "jump": 1}, {"seek_s": float("nan")},
     {"speed": float("inf")}],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused(player: PlaybackClock, asked: object) -> None:
    with pytest.raises(ValueError):
        player.handle_request(asked, 1.0)
    assert player.state(5.0) == (0.0, 10.0, False, 1.0, None)


ASKED = st.one_of(
    st.fixed_dictionaries({"play": st.booleans()}),
    st.fixed_dictionaries({"seek_s": st.floats(-20.0, 20.0)}),
    st.fixed_dictionaries({"speed": st.sampled_from(SPEEDS)}),
    st.fixed_dictionaries({"step": st.sampled_from(STEPS)}),
)


@given(st.lists(st.tuples(st.floats(0.0, 3.0), ASKED), max_size=20))
def test_whatever_is_asked_it_stays_inside_and_never_runs_backwards_by_itself(asked: list) -> None:
    player, now_s = made(), 0.0
    for wait_s, desired in asked:
        before = player.state(now_s)
        now_s += wait_s
        after = player.state(now_s)
        assert before.at_s <= after.at_s <= 10.0
        assert after.at_s - before.at_s <= wait_s * before.speed + 1e-6
        try:
            player.handle_request(desired, now_s)
        except ValueError as error:
            assert str(error).startswith("there is no")
        assert 0.0 <= player.state(now_s).at_s <= 10.0
