"""What flies at the face shuts the lids and draws the head back, but not what is slow or passes."""

from fakes.scenes import EmptyScene
from human.measured_run import measured_run

from gazerig.sim_mock.scenes.scene import Thing

FIRST_S, EVERY_S, FAR_M = 5.0, 4.0, 3.2
BALLS = (6.0, 0.0, 0.0), (6.0, 0.4, 0.0), (1.3, 0.0, 0.0), (6.0, 0.0, 0.6)
"""Speed in m/s, metres to the left for each of distance, and where it passes; two arrive."""


class Balls(EmptyScene):
    """A ball every four seconds."""

    name = "balls"

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the ball that flies now."""
        number, since_s = divmod(t_s - FIRST_S, EVERY_S)
        if number < 0.0:
            return ()
        m_s, slope, passes_m = BALLS[int(number) % len(BALLS)]
        x = FAR_M - m_s * since_s
        return (Thing(0, "thing", (x, slope * x + passes_m, 0.1), 0.1),) if x > 0.2 else ()


def test_a_ball_at_the_face_shuts_the_lids_in_time_and_draws_the_head_back():
    quiet = {
        "gaze.lids.blinks_per_min": 0.0, "gaze.idle.explores": False, "loop.rate_hz": 100.0
    }  # fmt: skip
    run = measured_run(Balls(), seed=101, seconds=21.0, bus="ideal", overrides=quiet)
    for number, (m_s, *_) in enumerate(BALLS):
        since_s = run.t_s - FIRST_S - EVERY_S * number
        flies = (since_s > 0.0) & (since_s < (FAR_M - 0.1) / m_s)
        assert (run.lids_goal[flies].max(axis=1).min() < 0.02) == (number < 2)
        pitch = run.head_deg[(since_s > 0.0) & (since_s < 0.7), 1]
        assert number >= 2 or pitch.max() - pitch[0] > 4.0
