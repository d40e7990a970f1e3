"""Motion of an emulated shaft: in steps of 1 ms, or in five of them at once.

A step is implicit: P and D act on position and speed at its end, because the real loop, much
faster than 1 kHz, acts during the step. So no gain of the registers makes the numbers diverge.
Five steps are one linear map while no sign changes. Its weights are those of the steps themselves,
computed once for each controller and voltage with sums and products only: the same on every
machine. The weight counts as constant during a span.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import inf, sin
from typing import NamedTuple

from gazerig.sim_mock.smart_servo.physics import Loop, Mechanics
from gazerig.sim_mock.smart_servo.profile import PositionProfile, SpeedProfile

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


SLOWEST = 1e-4
"""Lower speeds, in steps/ms, count as 0."""

HELD_SAFELY = 0.999
"""Share of the dry friction that certainly holds."""

RESOLUTION = 0.5
"""Resolution of the encoder in steps: the integrator is constant within this error."""


class ShaftState(NamedTuple):
    """All variables of a shaft's motion, and the state of its profile."""

    x: float
    v: float
    rv: float
    u: float
    effort: float
    integral: float
    joint: float
    volts: float
    profile: tuple[float, ...]


class ShaftMotion:
    """The variables of a shaft's motion, and their integration.

    x, v: position in steps and speed in steps/ms, as the encoder would measure them, unrounded
    joint: position of the joint behind the play
    u, effort: PWM and torque (proportional to current) as shares
    supply: open-circuit voltage, and
    volts: present voltage, both as shares of the rated one
    quiet: nothing will change until a write or a push by hand
    """

    __slots__ = (
        "_built", "_constant", "_heavy", "_high", "_integral", "_linear", "_load", "_loop", "_low",
        "_rv", "_since_ms",
        "_span_start", "_weights",
        "effort", "joint", "profile", "quiet", "supply", "u", "v", "volts", "x",
    )  # fmt: skip

    x: float
    v: float
    joint: float
    u: float
    effort: float
    supply: float
    volts: float
    quiet: bool
    profile: PositionProfile | SpeedProfile
    _built: Mechanics
    _loop: Loop
    _linear: bool
    _low: float
    _high: float
    _constant: float
    _heavy: bool
    _load: float
    _integral: float
    _rv: float
    _since_ms: int
    _span_start: ShaftState | None
    _weights: dict[tuple[int, float], SpanWeights]

    def run(self, ticks: int) -> None:
        """Advance by a number of milliseconds.

        The shaft moves from change to change in spans of 5 ms. A reading within a span is computed
        from the span's start each time, so it does not change the end of the span.
        """
        if ticks == SPAN_MS and not self._since_ms and not self.quiet:
            self._advance(SPAN_MS)  # in every tick of a loop at 200 Hz
            return
        while ticks > 0 and not self.quiet:
            since = self._since_ms
            until = min(since + ticks, SPAN_MS)
            if since and self._span_start is not None:
                begun = self._span_start
                self.x, self.v, self._rv, self.u = begun[:4]
                self.effort, self._integral, self.joint, self.volts = begun[4:8]
                self.profile.restore(begun.profile)
            elif until < SPAN_MS:
                self._span_start = ShaftState(
                    self.x, self.v, self._rv, self.u, self.effort, self._integral, self.joint,
                    self.volts, self.profile.state(),
                )  # fmt: skip
            self._advance(until)
            self._since_ms = until % SPAN_MS
            ticks -= until - since

    def _advance(self, ticks: int) -> None:
        """Advance by some milliseconds, in one map if possible, otherwise one by one."""
        loop, profile, v = self._loop, self.profile, self.v
        if self._heavy:
            built, x = self._built, self.x
            pull = built.gravity * sin((x - built.upright) * built.turn)
            self._load = self._constant + pull
        # Without a speed to follow, D only brakes.
        kr = 0.0 if profile.is_jump else loop.d + loop.f1
        led = profile.running
        linear = self._linear and self._integral == 0.0
        quick = linear and ticks == SPAN_MS
        # The fast paths: friction holds it, or it moves on. With a limited change of the duty, as
        # in X330 servos, it meets that limit too often.
        if quick and v == 0.0 and not led and self._stick(kr):
            return
        before = profile.r
        path = profile.advance(ticks)
        glides = quick and loop.slew == inf and abs(v) > self._built.dry
        if glides and self._glide(path if led else None, before, kr):
            return
        if v == 0.0:
            was = self.x, self.u, self._integral, self.joint, self.volts
            if not (self._linear and self._integral == 0.0 and self._step(path, before, kr)):
                self._follow(path, before, kr)
            if self.v == 0.0 and self._rv == 0.0 and not self.profile.running:
                self.quiet = was == (self.x, self.u, self._integral, self.joint, self.volts)
        elif not (linear and self._step(path, before, kr)):
            self._follow(path, before, kr)

    def _stick(self, kr: float) -> bool:
        """Hold the position for a span if friction holds it; return False if it may not."""
        kp, slew, u_max, built = self._loop.p, self._loop.slew, self._loop.u_max, self._built
        rv, pulled = self._rv, kp * (self.profile.r - self.x)
        push, load = built.accel * self.supply, self._load
        u_first = pulled + kr * (rv * (1.0 - SMOOTHING))
        for _ in range(SPAN_MS):
            rv -= rv * SMOOTHING
            if -SLOWEST < rv < SLOWEST:
                rv = 0.0
        u = pulled + kr * rv
        hold = built.dry * HELD_SAFELY
        if not (
            -hold <= load + push * u_first <= hold
            and -hold <= load + push * u <= hold
            and abs(u_first - self.u) <= slew
            and abs(u_first) <= u_max
        ):
            return False
        volts = self.supply / (1.0 + built.sag * u * u)
        self.quiet = rv == self._rv and u == self.u and volts == self.volts
        self._rv, self.u, self.volts = rv, u, volts
        self.effort = u * volts
        return True

    def _glide(self, path: Sequence[float] | None, before: float, kr: float) -> bool:
        """Move for a span if no sign changes in it; return False if one may change.

        path: the profile's position after each millisecond, None if it rests
        before: its position at the start
        """
        loop = self._loop
        accel, drag, _, dry, rate, _, _, _, play, sag = self._built
        kp, kd, u_max = loop.p, loop.d, loop.u_max
        v, rv, volts, error = self.v, self._rv, self.volts, before - self.x
        level = round(volts * VOLTAGE_LEVELS)
        weights = self._weights.get((level, kr))
        if weights is None:
            weights = self._weights[level, kr] = span_weights(drag, accel, kp, kd, kr, level)
        still, led, push, divisor = weights
        end, first, jump = before, 0.0, 0.0
        if path is not None:
            p1, p2, p3, p4, end = path
            first, d2, d3, d4, d5 = p1 - before, p2 - p1, p3 - p2, p4 - p3, end - p4
            bend = abs(d3 - d2 - d2 + first) + abs(d4 - d3 - d3 + d2) + abs(d5 - d4 - d4 + d3)
            # The largest change of the duty after its first change when the profile bends.
            jump = (kp + kr * SMOOTHING) * bend * drag / divisor
        torque = self._load - dry if v > 0.0 else self._load + dry
        rv_first = rv + (first - rv) * SMOOTHING
        v_first = (v + push * (kp * (error + first) + kr * rv_first) + torque) / divisor
        u_first = kp * (error + first - v_first) + kr * rv_first - kd * v_first
        if not ((v_first > dry if v > 0.0 else v_first < -dry) and abs(u_first) + jump <= u_max):
            return False
        ee, ev, er, et, ve, vv, vr, vt, rr = still
        error_end = ee * error + ev * v + er * rv + et * torque
        v_end = ve * error + vv * v + vr * rv + vt * torque
        rv_end = rr * rv
        if path is not None:
            e1, e2, e3, e4, e5, v1, v2, v3, v4, v5, r1, r2, r3, r4, r5 = led
            error_end += e1 * first + e2 * d2 + e3 * d3 + e4 * d4 + e5 * d5
            v_end += v1 * first + v2 * d2 + v3 * d3 + v4 * d4 + v5 * d5
            rv_end += r1 * first + r2 * d2 + r3 * d3 + r4 * d4 + r5 * d5
        u, x = kp * error_end + kr * rv_end - kd * v_end, end - error_end
        if not (
            (v_end > dry if v > 0.0 else v_end < -dry)
            and abs(u) + jump <= u_max
            and self._low <= x <= self._high
        ):
            return False
        self.x, self.v, self.u = x, v_end, u
        self._rv = 0.0 if -SLOWEST < rv_end < SLOWEST else rv_end
        self.effort = t = u * volts - v_end * rate
        power = u * t
        self.volts = self.supply - sag * power if power > 0.0 else self.supply
        if not -play <= x - self.joint <= play:
            self.joint = x - play if x > self.joint else x + play
        return True

    def _step(self, path: Sequence[float], before: float, kr: float) -> bool:
        """Do the same as ``_follow``, bit by bit, while no limit is met; otherwise return False.

        This happens every tick while the shaft starts, stops or reverses.
        """
        kp, u_max, slew = self._loop.p, self._loop.u_max, self._loop.slew
        accel, drag, _, dry, rate, _, _, _, play, sag = self._built
        x, v, u, joint, rv = self.x, self.v, self.u, self.joint, self._rv
        low, high, supply, volts, load = self._low, self._high, self.supply, self.volts, self._load
        u_least, slew_down, play_low, t = -u_max, -slew, -play, self.effort
        smoothing, slowest, slowest_back = SMOOTHING, SLOWEST, -SLOWEST
        k = kp + self._loop.d
        for r in path:
            rv += (r - before - rv) * smoothing
            if slowest_back < rv < slowest:
                rv = 0.0
            before = r
            c = kp * (r - x) + kr * rv
            push = accel * volts
            w = v + load + push * c
            if w > dry:
                v = (w - dry) / (drag + push * k)
            elif w < -dry:
                v = (w + dry) / (drag + push * k)
            else:
                v = 0.0
            earlier, u = u, c - k * v
            x += v
            if not (
                u_least <= u <= u_max and slew_down <= u - earlier <= slew and low <= x <= high
            ):
                return False
            t = u * volts - v * rate
            power = u * t
            volts = supply - sag * power if power > 0.0 else supply
            if not play_low <= x - joint <= play:
                joint = x - play if x > joint else x + play
        self.x, self.v, self.u, self.effort = x, v, u, t
        self.joint, self.volts, self._rv = joint, volts, rv
        return True

    def _follow(self, path: Sequence[float], before: float, kr: float) -> None:
        """Follow a path of one position per millisecond, with a gain on its speed."""
        kp, ki, kd, vi, _, kf2, bias, u_max, torque_max, slew = self._loop
        accel, drag, free, dry, rate, _, _, _, play, sag = self._built
        x, v, u, t, i, joint = self.x, self.v, self.u, self.effort, self._integral, self.joint
        low, high, supply, volts, load = self._low, self._high, self.supply, self.volts, self._load
        rv, u_least, t_least, slew_down, play_low = self._rv, -u_max, -torque_max, -slew, -play
        integrating = ki != 0.0 or vi != 0.0
        k = kp + kd
        for r in path:
            last = rv
            rv += (r - before - rv) * SMOOTHING
            if -SLOWEST < rv < SLOWEST:
                rv = 0.0
            before = r
            c = kp * (r - x) + kr * rv + i + bias
            if kf2:
                c += kf2 * (rv - last)
            pull = v + load
            push = accel * volts
            w = pull + push * c
            # Dry friction stops what the torque of 1 ms cannot move.
            if w > dry:
                v = (w - dry) / (drag + push * k)
            else:
                v = (w + dry) / (drag + push * k) if w < -dry else 0.0
            earlier, u = u, c - k * v
            clipped = not (u_least <= u <= u_max and slew_down <= u - earlier <= slew)
            if clipped:
                least, most = earlier - slew, earlier + slew
                u = most if u > most else least if u < least else u
                u = u_max if u > u_max else u_least if u < u_least else u
                w = pull + push * u
                v = (w - dry) / drag if w > dry else (w + dry) / drag if w < -dry else 0.0
            t = u * volts - v * rate
            if not t_least <= t <= torque_max:
                clipped = True
                t = torque_max if t > torque_max else t_least
                w = pull + accel * t
                v = (w - dry) / free if w > dry else (w + dry) / free if w < -dry else 0.0
                u = (t + v * rate) / volts if volts > 0.0 and torque_max > 0.0 else 0.0
            x += v
            if not low <= x <= high:
                x, v = high if x > high else low, 0.0
                u = min(max(c, earlier - slew, u_least), earlier + slew, u_max)
                u, t = _stall_state(u, volts, torque_max)
            power = u * t
            volts = supply - sag * power if power > 0.0 else supply
            if integrating and not clipped:
                if vi:
                    i += vi * (rv - v)
                elif r - x > RESOLUTION or x - r > RESOLUTION:
                    i += ki * (r - x)
                i = u_max if i > u_max else u_least if i < u_least else i
            if not play_low <= x - joint <= play:
                joint = x - play if x > joint else x + play
        self.x, self.v, self.u, self.effort, self._integral = x, v, u, t, i
        self.joint, self.volts, self._rv = joint, volts, rv


def _stall_state(u: float, volts: float, torque_max: float) -> tuple[float, float]:
    """Return PWM and torque of a shaft that cannot move, within its torque limit."""
    t = u * volts
    if -torque_max <= t <= torque_max:
        return u, t
    t = torque_max if t > torque_max else -torque_max
    return (t / volts if volts > 0.0 and torque_max > 0.0 else 0.0), t
