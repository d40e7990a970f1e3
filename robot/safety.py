"""The guard between wish and bus: knows limits, measurements and ages, nothing of gaze.

Whatever is wished, what leaves is finite, inside every joint's range, within its speed
and its acceleration, and always able to stop before the end of the range. Radians.
"""

from dataclasses import dataclass, field
from math import inf, isfinite, radians, sqrt
from typing import NamedTuple

from robot.types import JOINTS, JointAngles, JointState, Level, Verdict

_TOLERANCE_RAD = 1e-9


class JointLimit(NamedTuple):
    """One joint's range, top speed and top acceleration (rad, rad/s, rad/s^2).

    The rest is what the joint's servo bears before it switches itself off: degrees
    Celsius, lowest and highest volts.
    """

    low_rad: float
    high_rad: float
    speed_rad_s: float
    accel_rad_s2: float
    hottest_c: float = 70.0
    lowest_v: float = 0.0
    highest_v: float = inf


@dataclass(frozen=True)
class GuardParams:
    """Ages beyond which nothing moves, and the speed of slow passages."""

    stale_joints_ms: float = field(
        default=150.0,
        metadata={
            "low": 5.0,
            "high": 5000.0,
            "unit": "ms",
            "says": "a joint whose last answer is older holds still",
        },
    )
    stale_picture_ms: float = field(
        default=1500.0,
        metadata={
            "low": 50.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "the neck holds still when the last picture is older",
        },
    )
    gentle_ms: float = field(
        default=1000.0,
        metadata={
            "low": 0.0,
            "high": 60000.0,
            "unit": "ms",
            "says": "shortest time of slow motion after torque-on",
        },
    )
    gentle_speed_deg_s: float = field(
        default=60.0,
        metadata={
            "low": 1.0,
            "high": 500.0,
            "unit": "deg/s",
            "says": "speed after torque-on and while parking",
        },
    )
    gentle_accel_deg_s2: float = field(
        default=300.0,
        metadata={
            "low": 1.0,
            "high": 50000.0,
            "unit": "deg/s2",
            "says": "acceleration after torque-on and while parking",
        },
    )


class Guard:
    """Checks every command, one tick after the other."""

    def __init__(self, params: GuardParams, limits: tuple[JointLimit, ...]) -> None:
        """Take one limit a joint, in the order of JOINTS."""
        self._params = params
        self._limits = limits
        self._neck = tuple(name.startswith("neck") for name in JOINTS)
        self.reset(0.0, tuple(0.5 * (limit.low_rad + limit.high_rad) for limit in limits))

    def reset(self, t_s: float, command_rad: JointAngles) -> None:
        """Begin from the goals that are in force on the bus, at rest, gently."""
        self._command = [
            min(max(angle, limit.low_rad), limit.high_rad)
            for angle, limit in zip(command_rad, self._limits, strict=True)
        ]
        self._speed = [0.0] * len(self._limits)
        self._t_s = t_s
        self.go_gently()

    def go_gently(self) -> None:
        """Move slowly for a while, and each joint until it has once met its wish."""
        self._gentle = [True] * len(self._limits)
        self._gentle_until_s = self._t_s + self._params.gentle_ms / 1e3

    @property
    def gentle(self) -> bool:
        """Tell whether any joint is still on its slow way."""
        return any(self._gentle)

    def check(
        self, wish_rad: JointAngles, joints: JointState, picture_age_s: float, t_s: float
    ) -> Verdict:
        """Give what may be sent now.

        wish_rad: any numbers at all
        picture_age_s: age of the newest picture; infinity before the first
        """
        dt_s = t_s - self._t_s
        if dt_s <= 0.0:
            return Verdict(tuple(self._command), "hold", ("all: time stands still",))
        self._t_s = t_s
        reasons: list[str] = []
        level: Level = "ok"
        blind = picture_age_s > self._params.stale_picture_ms / 1e3
        stale_s = t_s - self._params.stale_joints_ms / 1e3
        for i, wish in enumerate(wish_rad):
            held = ""
            if not isfinite(wish):
                held = "not finite"
            elif joints.measured_s[i] < stale_s:
                held = "stale joints"
            elif blind and self._neck[i]:
                held = "stale picture"
            reason = held or self._range_reason(i, wish)
            changed = self._advance(i, None if held else wish, dt_s)
            reason = reason or changed
            if reason:
                reasons.append(f"{JOINTS[i]}: {reason}")
                level = "hold" if held or level == "hold" else "limited"
        return Verdict(tuple(self._command), level, tuple(reasons))

    def _range_reason(self, i: int, wish: float) -> str:
        limit = self._limits[i]
        outside = wish < limit.low_rad - 1e-9 or wish > limit.high_rad + 1e-9
        return "out of range" if outside else ""

    def _advance(self, i: int, wish: float | None, dt_s: float) -> str:
        """Move one joint towards its wish (None: to a stop); give why it fell short.

        The speed v' of this step must keep p' + v'^2 / 2a inside the range. As
        v'^2 / 2a bounds every later sequence of braking steps, a joint that keeps this
        can always stop in time, whatever the length of the ticks to come.
        """
        low, high, fastest, accel, *_ = self._limits[i]
        p, v = self._command[i], self._speed[i]
        step = accel * dt_s
        if wish is not None and not self._gentle[i] and low <= wish <= high:
            # Nearly every wish is a good one and is passed on as it is.
            wanted = (wish - p) / dt_s
            brake = 0.5 * wanted * wanted / accel
            fits = wish + brake <= high if wanted > 0.0 else wish - brake >= low
            if fits and -fastest <= wanted <= fastest and v - step <= wanted <= v + step:
                self._command[i], self._speed[i] = wish, wanted
                return ""
        if self._gentle[i]:
            fastest = min(fastest, radians(self._params.gentle_speed_deg_s))
            # Braking keeps the joint's own strength: a gentle passage may begin in flight.
            gentle = min(accel, radians(self._params.gentle_accel_deg_s2))
        else:
            gentle = accel
        wanted = 0.0 if wish is None else (min(max(wish, low), high) - p) / dt_s
        if wish is not None and self._gentle[i]:
            wanted = _approach(min(max(wish, low), high) - p, gentle, dt_s)
            if abs(wish - p) < radians(1.0) and self._t_s >= self._gentle_until_s:
                self._gentle[i] = False
        top = min(fastest, _brakeable(high - p, accel, dt_s))
        bottom = -min(fastest, _brakeable(p - low, accel, dt_s))
        hardest = v + (gentle if v >= 0.0 else accel) * dt_s
        softest = v - (gentle if v <= 0.0 else accel) * dt_s
        allowed = min(max(wanted, bottom), top)
        chosen = min(max(allowed, softest), hardest)
        # The range and the braking distance win over gentleness, never over the joint's
        # own acceleration, which the invariant above makes sufficient.
        chosen = min(max(chosen, max(bottom, v - step)), max(min(top, v + step), v - step))
        moved = min(max(p + chosen * dt_s, low), high)
        self._command[i] = moved
        self._speed[i] = (moved - p) / dt_s
        if wish is None or abs(wanted - chosen) * dt_s <= _TOLERANCE_RAD:
            return "starting slowly" if self._gentle[i] else ""
        if self._gentle[i]:
            return "starting slowly"
        return "too fast" if abs(wanted) > fastest else "too hard"


def _brakeable(room: float, accel: float, dt_s: float) -> float:
    """Give the highest speed for one step after which a stop within ``room`` is possible.

    Solves v dt + v^2 / 2a = room for v.
    """
    half = accel * dt_s
    return sqrt(half * half + 2.0 * accel * max(0.0, room)) - half


def _approach(distance: float, accel: float, dt_s: float) -> float:
    """Give the speed towards a resting wish from which braking at ``accel`` ends on it."""
    speed = _brakeable(abs(distance), accel, dt_s)
    return speed if distance >= 0.0 else -speed
