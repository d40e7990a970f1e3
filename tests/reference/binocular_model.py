"""Reference model of the binocular controller, in eye angles of one axis (no profile runs it).

Zhang & Wakamatsu's structure with everything that a robot with one camera cannot show: an eye
that is covered and goes with the seeing one, by copy or by the crossed path alone; feedback of
the delayed error without the efference copy; the dark. gazerig.gaze.oculomotor.binocular, which
the profile mitake runs, is held to the same numbers. Head frame; yaw + left, or pitch + up with one
value for both eyes; radians inside, degrees and milliseconds in the parameters.
"""

from collections import deque
from dataclasses import dataclass
from math import radians
from typing import Annotated, Literal, NamedTuple

from reference.channels import ConjugateChannel, LeakyIntegrator, VergenceChannel
from reference.vestibular import SemicircularCanals, distance_m, translational_rad_s

from gazerig.gaze.angles import clip
from gazerig.params import Bounds


@dataclass(frozen=True)
class BinocularParams:
    """Gains, delays and ranges."""

    # fmt: off
    delay_ms: Annotated[float, Bounds(0, 500), "delay tau_c of seeing"] = 100.0
    smooth_ms: Annotated[float, Bounds(0.1, 500), "smoothing Tf of what is seen"] = 40.0
    velocity_gain: Annotated[float, Bounds(0, 1.2), "share Gp of the target's speed that is taken over at once"] = 0.95
    max_speed_deg_s: Annotated[float, Bounds(1, 200), "fastest pursuit v_max"] = 60.0
    reject_deg_s: Annotated[float, Bounds(1, 1000), "faster than this is a jump of the target and not a motion, v_rej"] = 100.0
    gain_1_s: Annotated[float, Bounds(0, 50), "conjugate gain Kc"] = 8.0
    max_error_deg: Annotated[float, Bounds(0.1, 180), "largest error e_max that counts; larger ones are saccades"] = 5.0
    lead_ms: Annotated[float, Bounds(0, 100), "lead h on a moving target"] = 0.0
    vergence_delay_ms: Annotated[float, Bounds(0, 500), "delay tau_d of vergence"] = 160.0
    converge_1_s: Annotated[float, Bounds(0, 50), "vergence gain Kd"] = 4.0
    diverge_1_s: Annotated[float, Bounds(0, 50), "gain Kdiv when diverging"] = 3.0
    max_vergence_deg: Annotated[float, Bounds(1, 60), "largest vergence"] = 20.0
    hold_s: Annotated[float, Bounds(0, 600), "time constant T_N of gaze holding; 0 holds for ever, 25 in the dark"] = 0.0
    fade_ms: Annotated[float, Bounds(1, 5000), "decay of the eye's speed when the target is lost"] = 300.0
    vor_gain: Annotated[float, Bounds(0, 1.5), "gain of the reflex; people .95"] = 1.0
    vor_delay_ms: Annotated[float, Bounds(0, 100), "delay tau_vor of the reflex"] = 10.0
    storage_s: Annotated[float, Bounds(0, 600), "velocity storage T_vs; 0 with a perfect gyroscope"] = 16.0
    servo_lead_ms: Annotated[float, Bounds(0, 30), "lead for the servos' own lag"] = 0.0
    interocular_mm: Annotated[float, Bounds(10, 500), "between the eye centres"] = 61.9
    eye_limit_deg: Annotated[float, Bounds(1, 90), "largest eye rotation to the left and to the right"] = 55.0
    covered: Annotated[Literal["copy", "cross"], "a covered eye goes all the way with the other, or by the crossed path only"] = "copy"
    efference: Annotated[bool, "know where the eyes were; without it only delayed errors steer"] = True
    # fmt: on


class HeadMotion(NamedTuple):
    """The head at this moment: yaw and its rate, velocity ahead and left, gate of the reflex."""

    yaw_rad: float = 0.0
    rate_rad_s: float = 0.0
    ahead_m_s: float = 0.0
    left_m_s: float = 0.0
    gate: float = 1.0


class _Moment(NamedTuple):
    left: float | None
    right: float | None
    eye_left: float
    eye_right: float
    head: float


AT_REST = HeadMotion()


class BinocularController:
    """Controls one axis of both eyes; for the vertical axis both get the same target."""

    def __init__(self, params: BinocularParams) -> None:
        par = self._params = params
        self._conjugate = ConjugateChannel(
            par.gain_1_s,
            par.velocity_gain,
            radians(par.max_error_deg),
            radians(par.max_speed_deg_s),
            radians(par.reject_deg_s),
            par.smooth_ms / 1e3,
            par.lead_ms / 1e3,
            par.fade_ms / 1e3,
        )
        self._vergence = VergenceChannel(par.converge_1_s, par.diverge_1_s)
        self._leak = LeakyIntegrator(par.hold_s)
        self._canals = SemicircularCanals(par.vor_delay_ms / 1e3, par.storage_s)
        self._limit = radians(par.eye_limit_deg)
        self.reset(0.0)

    def reset(self, t_s: float, version_rad: float = 0.0, vergence_rad: float = 0.0) -> None:
        """Start at rest at the given eye angles, with no target seen."""
        self.version_rad, self.vergence_rad = version_rad, vergence_rad
        self._conjugate.reset()
        self._canals.reset()
        self._past: deque[_Moment] = deque()
        self._eyes = self._angles(0.0, 0.0)

    def step(
        self,
        left_rad: float | None,
        right_rad: float | None,
        head: HeadMotion,
        dt_s: float,
        saccade: tuple[float, float] | None = None,
    ) -> tuple[float, float]:
        """Return the left and right eye angle in the head for the next period.

        left_rad, right_rad: direction in space of the target from each eye; None: not seen
        saccade: version and vergence that a present saccade prescribes
        """
        par = self._params
        eye_left, eye_right = self._eyes
        self._past.append(_Moment(left_rad, right_rad, eye_left, eye_right, head.yaw_rad))
        seen = self._ago(par.delay_ms / 1e3, dt_s)
        reflex = self._reflex(head, dt_s)
        if saccade is not None:
            self._conjugate.hold(_place(seen))
            self.version_rad, self.vergence_rad = saccade
            u_c = u_d = 0.0
        else:
            u_c, u_d = self._wishes(seen, head.yaw_rad, dt_s)
            u_c -= reflex
            self.version_rad = self._leak.step(self.version_rad, u_c, dt_s)
            self.vergence_rad = self._leak.step(self.vergence_rad, u_d, dt_s)
        self.version_rad = clip(self.version_rad, self._limit)
        widest = radians(par.max_vergence_deg)
        self.vergence_rad = min(max(self.vergence_rad, 0.0), widest)
        self._eyes = self._angles(u_c, u_d)
        return self._eyes

    def _wishes(self, seen: _Moment | None, head: float, dt_s: float) -> tuple[float, float]:
        """Return the conjugate and the vergence rate."""
        par = self._params
        gaze = self.version_rad + head
        place = _place(seen)
        if place is None or seen is None:
            return self._conjugate.step(None, gaze, dt_s), 0.0
        if not par.efference:
            # Only the error as it was: what the eyes did since is not known.
            was = 0.5 * (seen.eye_left + seen.eye_right) + seen.head
            u_c = par.gain_1_s * clip(place - was, radians(par.max_error_deg))
        else:
            u_c = self._conjugate.step(place, gaze, dt_s)
        if seen.left is not None and seen.right is not None:
            return u_c, self._vergence.step(self._demand(dt_s), self.vergence_rad)
        if par.covered == "copy":
            return u_c, 0.0
        # The blind side sends nothing: the seeing eye gets rho, the covered one chi.
        side = 1.0 if seen.left is not None else -1.0
        return 0.5 * u_c, -side * par.converge_1_s * u_c / par.gain_1_s

    def _demand(self, dt_s: float) -> float | None:
        """Return the target's vergence at the time when it was seen."""
        then = self._ago(self._params.vergence_delay_ms / 1e3, dt_s)
        if then is None or then.left is None or then.right is None:
            return None
        return then.right - then.left

    def _reflex(self, head: HeadMotion, dt_s: float) -> float:
        """Return the conjugate rate that the head's turning and moving call for."""
        par = self._params
        turning = par.vor_gain * head.gate * self._canals.step(head.rate_rad_s, dt_s)
        if head.ahead_m_s == 0.0 and head.left_m_s == 0.0:
            return turning
        distance = distance_m(self.vergence_rad, par.interocular_mm / 1e3)
        return turning - translational_rad_s(
            self.version_rad, head.ahead_m_s, head.left_m_s, distance
        )

    def _ago(self, delay_s: float, dt_s: float) -> _Moment | None:
        """Return what there was a delay ago, None before the beginning."""
        par = self._params
        longest = round(max(par.delay_ms, par.vergence_delay_ms) / 1e3 / dt_s)
        while len(self._past) > longest + 1:
            self._past.popleft()
        back = round(delay_s / dt_s)
        return self._past[-1 - back] if len(self._past) > back else None

    def _angles(self, u_c: float, u_d: float) -> tuple[float, float]:
        """Return both eyes' angles, advanced by the servos' lag and kept in range."""
        lead = self._params.servo_lead_ms / 1e3
        c, v = self.version_rad, self.vergence_rad
        return (
            clip(c - 0.5 * v + lead * (u_c - 0.5 * u_d), self._limit),
            clip(c + 0.5 * v + lead * (u_c + 0.5 * u_d), self._limit),
        )


def _place(seen: _Moment | None) -> float | None:
    """Return where in space the target was: the retinal error plus the gaze of that moment."""
    if seen is None:
        return None
    errors = []
    if seen.left is not None:
        errors.append(seen.left - seen.head - seen.eye_left)
    if seen.right is not None:
        errors.append(seen.right - seen.head - seen.eye_right)
    if not errors:
        return None
    return sum(errors) / len(errors) + 0.5 * (seen.eye_left + seen.eye_right) + seen.head
