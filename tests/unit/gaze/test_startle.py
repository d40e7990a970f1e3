"""What flies at the face shuts the lids and draws the head back, but not what is slow or passes."""

import numpy as np
from attention_scene import FACE, body, percept
from fakes.scenes import EmptyScene
from human.measured_run import measured_run
from msgspec.structs import replace

from gazerig.gaze.angles import add, scale
from gazerig.gaze.attention.startle import Startle
from gazerig.sim_mock.scenes.scene import Thing

HEAD = (0.1, -0.2, 0.3)


def test_what_arrives_soon_fast_and_straight_startles():
    for starts, away_m, speed, aside_m, sd_m_s, age_s, kind in (
        # At 6 m/s .4 s are 2.4 m; it has not arrived yet, and passes by less than .3 m.
        (True, 2.35, 6.0, 0.28, 0.1, 0.0, "thing"), (False, 2.45, 6.0, 0.0, 0.1, 0.0, "thing"),
        (True, 2.45, 6.0, 0.0, 0.1, 0.05, "thing"), (False, 2.0, 6.0, 0.0, 0.1, 0.35, "thing"),
        (False, 2.0, 6.0, 0.32, 0.1, 0.0, "thing"), (False, 2.0, 6.0, 0.0, 0.1, 0.0, "face"),
        # It is faster than 2 m/s by a standard deviation.
        (True, 0.5, 2.5, 0.0, 0.4, 0.0, "hand"), (False, 0.5, 2.5, 0.0, 0.6, 0.0, "hand"),
    ):  # fmt: skip
        way, model = (-0.6, 0.0, -0.8), Startle()
        place = add(add(HEAD, scale(way, -away_m)), (0.0, aside_m, 0.0))
        seen = percept(5.0, FACE, body(2, kind, place, scale(way, speed)))
        assert not model.step(seen, HEAD, 5.0 + age_s) and not model.step(None, HEAD, 5.0)
        cov = np.diag((sd_m_s**2, 9.0, sd_m_s**2))  # what is across the path does not count
        seen = replace(seen, bodies=replace(seen.bodies, v_cov=np.array([cov, cov])))
        assert model.step(seen, HEAD, 5.0 + age_s) is starts
        for t_s, again in ((5.9, False), (6.1, starts)):
            assert model.step(replace(seen, captured_s=t_s - age_s), HEAD, t_s) is again


FIRST_S, EVERY_S, FAR_M = 5.0, 4.0, 3.2
BALLS = (6.0, 0.0, 0.0), (6.0, 0.4, 0.0), (1.3, 0.0, 0.0), (6.0, 0.0, 0.6)
"""Speed in m/s, metres to the left for each of distance, and where it passes; two arrive."""


class Balls(EmptyScene):
    """A ball every four seconds."""

    name = "balls"

    def things(self, t_s):
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
