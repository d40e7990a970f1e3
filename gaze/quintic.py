"""A movement from any state to rest: fifth-order polynomial of the time.

The smoothest curve (least jerk) between given ends. Any unit; speed and acceleration are
per second.
"""


class Quintic:
    """Fifth-order polynomial to a resting goal from any position, speed and acceleration.

    From rest it is eq 8, theta0 + (goal - theta0) (6 s^5 - 15 s^4 + 10 s^3).
    """

    def __init__(self, start: tuple[float, float, float], goal: float, duration_s: float) -> None:
        p, v, a = start
        T = duration_s
        d = goal - p
        self._goal, self._T = goal, T
        self._c = (
            p,
            v,
            0.5 * a,
            (20.0 * d - 12.0 * v * T - 3.0 * a * T * T) / (2.0 * T**3),
            (-30.0 * d + 16.0 * v * T + 3.0 * a * T * T) / (2.0 * T**4),
            (12.0 * d - 6.0 * v * T - a * T * T) / (2.0 * T**5),
        )

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Return position, speed and acceleration at a time since the start."""
        if t_s >= self._T:
            return (self._goal, 0.0, 0.0)
        c0, c1, c2, c3, c4, c5 = self._c
        t = t_s if t_s > 0.0 else 0.0
        return (
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
        )

    def position(self, t_s: float) -> float:
        """Return the position alone, the first value of ``at``."""
        if t_s >= self._T:
            return self._goal
        c0, c1, c2, c3, c4, c5 = self._c
        t = t_s if t_s > 0.0 else 0.0
        return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
