"""The shaft of an emulated servo: controller, motor, friction, stops, play, in steps of 1 ms.

Inside: steps (4096 a turn) and milliseconds; torque as a share of the stall torque at the
rated voltage, PWM as a share of full. One step is an implicit one: P and D act on position
and speed at its end, as the real loop, much faster than 1 kHz, would make them act on the
way. So no gain the registers allow can shake the numbers to infinity. What
is read does not depend on how often it is read.
"""

from collections.abc import Sequence
from math import inf, pi, sin
from typing import NamedTuple, Protocol

from gazerig.sim_mock.smart_servo.physics import Physics
from gazerig.sim_mock.smart_servo.profile import PositionProfile, SpeedProfile

STEPS_PER_TURN = 4096
"""Resolution of the encoder on the shaft; a make may count otherwise in its registers."""
STEPS_PER_RAD = STEPS_PER_TURN / (2.0 * pi)
MS_S = 0.001
SAG_MOST = 0.5
"""Share of the voltage that the supply may lose at stall; more would hunt."""

SMOOTHING = 0.25
"""Share of the profile's new speed that D and feed-forward take over in 1 ms: what differs from
one millisecond to the next must be smoothed in any servo, the time of 4 ms is assumed."""

SLOWEST = 1e-4
"""Speeds below, in steps/ms, are none."""

RESOLUTION = 0.5
"""The encoder sees no smaller error: the I part rests inside it, in steps."""


class Motor(Protocol):
    """What the shaft must know of a servo's motor and gear."""

    @property
    def stall_torque_nm(self) -> float:
        """Return the torque that holds it still."""
        ...

    @property
    def stall_current_a(self) -> float:
        """Return the current it draws then."""
        ...

    @property
    def no_load_rpm(self) -> float:
        """Return the speed without load."""
        ...

    @property
    def rated_v(self) -> float:
        """Return the voltage that all this is for."""
        ...


class Loop(NamedTuple):
    """Controller gains and limits, in shares of full PWM per step, per step/ms and so on.

    p, d, f1, f2: on position error, speed error, profile speed, profile acceleration
    i: per ms on position error; vi: per ms on speed error (velocity mode)
    bias: constant part, in the modes without feedback
    u_most: PWM limit; t_most: torque (current) limit; slew: most change of PWM per ms
    """

    p: float = 0.0
    i: float = 0.0
    d: float = 0.0
    vi: float = 0.0
    f1: float = 0.0
    f2: float = 0.0
    bias: float = 0.0
    u_max: float = 1.0
    torque_max: float = inf
    slew: float = inf


class _Built(NamedTuple):
    """What never changes of a shaft, in steps and milliseconds.

    accel: speed that the stall torque adds in 1 ms
    drag, free: what divides a speed after 1 ms, with the motor's own braking and without
    dry: speed that dry friction takes in 1 ms
    rate: share of the rated voltage that the motor induces per step/ms
    gravity: speed that the weight adds in 1 ms at its full lever; upright: where it has none
    play: half the dead travel; sag: share of the voltage that the supply loses at stall
    """

    accel: float
    drag: float
    free: float
    dry: float
    rate: float
    gravity: float
    upright: float
    play: float
    sag: float


DISABLED = Loop(u_max=0.0, torque_max=0.0)

PAUSE_MS = 10_000
"""A time without any packet that is longer is not lived through millisecond by millisecond."""
_BEFORE_MS, _AFTER_MS = 3_000, 1_000
"""Of such a pause these are: whatever was begun ends, and what is asked then is in motion."""


def long_pause(now_ms: int, until_ms: int, unit_ms: int) -> tuple[int, int]:
    """Return start and length of the part of a pause that is skipped; (until, 0) for short pauses.

    unit_ms: The time passed at once is a whole number of these.
    """
    if until_ms - now_ms <= PAUSE_MS:
        return until_ms, 0
    between_ms = until_ms - now_ms - _BEFORE_MS - _AFTER_MS
    return now_ms + _BEFORE_MS, between_ms // unit_ms * unit_ms


def flicker(now_ms: int, seed: int, current: int, velocity: int) -> tuple[int, int]:
    """Return the noise of current and velocity of a servo that holds still.

    A number of time and seed alone, so that reading does not change it; velocity is
    mostly 0.
    """
    mixed = (now_ms * 0x9E3779B1 ^ seed * 0x27D4EB2F) & 0xFFFFFFFF
    mixed = ((mixed ^ mixed >> 15) * 0x85EBCA6B) & 0xFFFFFFFF
    mixed ^= mixed >> 13
    amps = mixed % (2 * current + 1) - current
    if mixed >> 24 & 3:
        return amps, 0
    return amps, (mixed >> 8) % (2 * velocity + 1) - velocity


def _stalled(u: float, volts: float, torque_max: float) -> tuple[float, float]:
    """Return PWM and torque of a shaft that cannot move, within its torque limit."""
    t = u * volts
    if -torque_max <= t <= torque_max:
        return u, t
    t = torque_max if t > torque_max else -torque_max
    return (t / volts if volts > 0.0 and torque_max > 0.0 else 0.0), t


class Shaft:
    """Position and speed of one output shaft, advanced in whole milliseconds.

    x, v: position in steps and speed in steps/ms, as the encoder would see them, unrounded
    joint: position of the joint behind the play
    u, effort: PWM and torque (which is current) as shares
    supply: open-circuit voltage, and
    volts: present voltage, both as shares of the rated one
    quiet: nothing will change until something is written or a hand pushes
    """

    __slots__ = (
        "_accel", "_built", "_held", "_high", "_integral", "_load", "_loop", "_low", "_low_high",
        "_play", "_rv",
        "effort", "joint", "profile", "quiet", "supply", "u", "v", "volts", "x",
    )  # fmt: skip

    def __init__(self, model: Motor, physics: Physics, position_steps: float) -> None:
        stall_nm = model.stall_torque_nm
        top_rad_s = model.no_load_rpm * pi / 30.0
        inertia = physics.rotor_s * stall_nm / top_rad_s + physics.load_kg_m2
        # Speed in steps/ms that the stall torque adds in 1 ms.
        self._accel = accel = stall_nm / inertia * STEPS_PER_RAD * MS_S * MS_S
        top = model.no_load_rpm / 60.0 * STEPS_PER_TURN * MS_S
        # Friction is part of the data sheet's no-load speed: the motor alone would be faster.
        rate = (1.0 - physics.coulomb_share - physics.viscous_share) / top
        viscous = physics.viscous_share / top
        self._play = physics.play_deg * STEPS_PER_TURN / 720.0
        self._built = _Built(
            accel,
            drag=1.0 + accel * (rate + viscous),
            free=1.0 + accel * viscous,
            dry=accel * physics.coulomb_share,
            rate=rate,
            gravity=accel * physics.gravity_nm / stall_nm,
            upright=physics.upright_steps,
            play=self._play,
            sag=min(SAG_MOST, physics.supply_ohm * model.stall_current_a / model.rated_v),
        )
        self._load = accel * physics.load_nm / stall_nm
        self._low_high = physics.stop_low_steps, physics.stop_high_steps
        self._low, self._high = self._low_high
        self.supply = self.volts = (physics.supply_v or model.rated_v) / model.rated_v
        self._loop = DISABLED
        self._held = False
        self.profile: PositionProfile | SpeedProfile = PositionProfile(position_steps)
        self.place(position_steps)

    # --- from outside

    def place(self, position_steps: float) -> None:
        """Place the shaft at rest between its stops; profile and controller go on from there."""
        x = min(max(float(position_steps), self._low_high[0]), self._low_high[1])
        self.x = self.joint = x
        self.v = self._rv = self.u = self.effort = self._integral = 0.0
        if isinstance(self.profile, PositionProfile):
            self.profile.rest(x)
        if self._held:
            self.jam(True)
        self.quiet = False

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, up to its stops; the controller keeps acting."""
        self.x = min(max(self.x + steps, self._low), self._high)
        self.quiet = False

    def jam(self, stuck: bool) -> None:
        """Jam the joint where it is, or free it."""
        self._held = stuck
        self._low, self._high = (self.x, self.x) if stuck else self._low_high
        self.quiet = False

    def set_load(self, share: float) -> None:
        """Set the constant torque on the joint as a share of the stall torque."""
        self._load = self._accel * share
        self.quiet = False

    def feed(self, supply: float) -> None:
        """Set the open-circuit voltage as a share of the rated one."""
        self.supply = self.volts = supply
        self.quiet = False

    # --- from the servo

    def drive(self, loop: Loop) -> None:
        """Apply controller settings."""
        if loop != self._loop:
            self._loop = loop
            self._integral = max(-loop.u_max, min(loop.u_max, self._integral))
            self.quiet = False

    def resume(self) -> None:
        """Mark the shaft as moving after its profile has changed."""
        self.quiet = False

    def start(self, profile: PositionProfile | SpeedProfile) -> None:
        """Switch on with an empty integrator; ``profile``: the reference."""
        self.profile = profile
        self._rv = self._integral = 0.0
        self.quiet = False

    def disable(self) -> None:
        """Switch off: the motor has no current and does not brake."""
        self.drive(DISABLED)
        self.profile = PositionProfile(self.x)
        self.u = self.effort = self._integral = 0.0
        self.quiet = False

    def run(self, ticks: int) -> None:
        """Move on by so many milliseconds."""
        if self.quiet or ticks <= 0:
            return
        loop, profile = self._loop, self.profile
        was = self.x, self.u, self._integral, self.joint, self.volts
        before, path = profile.r, profile.ahead(ticks)
        # Where there is no speed to follow, D brakes only.
        self._follow(path, before, 0.0 if profile.jumps else loop.d + loop.f1)
        still = self.v == 0.0 and self._rv == 0.0 and not profile.running
        self.quiet = still and was == (self.x, self.u, self._integral, self.joint, self.volts)

    def _follow(self, path: Sequence[float], before: float, kr: float) -> None:
        """Follow a path of one position a millisecond, with a gain on its speed."""
        kp, ki, kd, vi, _, kf2, bias, u_max, torque_max, slew = self._loop
        accel, drag, free, dry, rate, gravity, upright, play, sag = self._built
        x, v, u, t, i, joint = self.x, self.v, self.u, self.effort, self._integral, self.joint
        low, high, supply, volts, load = self._low, self._high, self.supply, self.volts, self._load
        rv, u_least, t_least, slew_down, play_low = self._rv, -u_max, -torque_max, -slew, -play
        integrating = ki != 0.0 or vi != 0.0
        k = kp + kd
        special = kf2 != 0.0 or gravity != 0.0
        for r in path:
            last = rv
            rv += (r - before - rv) * SMOOTHING
            if -SLOWEST < rv < SLOWEST:
                rv = 0.0
            before = r
            c = kp * (r - x) + kr * rv + i + bias
            if special:
                c += kf2 * (rv - last)
                load = self._load + gravity * sin((x - upright) / STEPS_PER_RAD)
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
                u, t = _stalled(u, volts, torque_max)
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

    def skip(self, ticks: int) -> None:
        """Skip a long time: the shaft moves as far as its profile, between its stops.

        What is not at rest after seconds without a question is led by a slow profile, turns
        for ever, or hunts around its goal; the last stays as it is.
        """
        if self.quiet or ticks <= 0:
            return
        before = self.profile.r
        self.profile.skip(ticks)
        moved = self.profile.r - before
        if self._loop.bias:  # without feedback: on at the speed it has
            moved = self.v * ticks
        self.x = min(max(self.x + moved, self._low), self._high)
        self.joint = min(max(self.joint, self.x - self._play), self.x + self._play)

    @property
    def speed_steps_s(self) -> float:
        """Return the speed of the shaft."""
        return self.v / MS_S
