"""Five milliseconds of a shaft at once: while no sign changes, its steps are one linear map.

The weights of that map are those of the steps themselves (gazerig.sim_mock.smart_servo.motor),
computed once for each controller and voltage with sums and products only: the same on every
machine.
"""

from functools import lru_cache

SPAN_MS = 5
SMOOTHING = 0.25
"""Share of the profile's new speed that D and feed-forward adopt in 1 ms: any servo must smooth
differences between milliseconds; the time of 4 ms is assumed."""

VOLTAGE_LEVELS = 1024
"""Levels per rated voltage; the voltage counts as constant during a span."""

Still = tuple[float, ...]
"""Weights of error, speed, reference speed and constant torque: for the error after the span (4),
for the speed (4); and of the reference speed for itself (1)."""
Led = tuple[float, ...]
"""Weights of the profile's motion in each millisecond: 5 each for error, speed, profile speed."""

SpanWeights = tuple[Still, Led, float, float]
"""Including push and divisor of the first millisecond."""


@lru_cache(maxsize=4096)
def span_weights(
    drag: float, accel: float, kp: float, kd: float, kr: float, level: int
) -> SpanWeights:
    """Return the weights for one controller and voltage.

    Args:
        drag: divisor of a speed per 1 ms, without the controller.
        accel: speed that the stall torque adds in 1 ms.
        kp: gain on the position error.
        kd: gain on the speed.
        kr: gain on the reference speed.
        level: voltage as a share of the rated one, in parts of ``VOLTAGE_LEVELS``.
    """
    push = accel * level / VOLTAGE_LEVELS
    divisor = drag + push * (kp + kd)
    none = (0.0,) * SPAN_MS

    def after(
        error: float, v: float, rv: float, torque: float, moves: tuple[float, ...]
    ) -> tuple[float, float, float]:
        for d in moves:
            rv += (d - rv) * SMOOTHING
            v = (v + push * (kp * (error + d) + kr * rv) + torque) / divisor
            error += d - v
        return error, v, rv

    own = (
        after(1.0, 0.0, 0.0, 0.0, none),
        after(0.0, 1.0, 0.0, 0.0, none),
        after(0.0, 0.0, 1.0, 0.0, none),
        after(0.0, 0.0, 0.0, 1.0, none),
    )
    moved = tuple(
        after(0.0, 0.0, 0.0, 0.0, (*none[:i], 1.0, *none[i + 1 :])) for i in range(SPAN_MS)
    )
    still = (*(one[0] for one in own), *(one[1] for one in own), own[2][2])
    led = tuple(one[part] for part in range(3) for one in moved)
    return still, led, push, divisor


def whole_ms(now_s: float) -> int:
    """Return the whole milliseconds of a time; the margin keeps 0.005 s from being 4 ms."""
    return int(now_s * 1000.0 + 1e-3)
