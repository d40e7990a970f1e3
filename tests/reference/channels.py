"""The separate parts of the reference model: conjugate, vergence and leak.

Zhang & Wakamatsu's controller splits into two independent controls with different
dynamics. With a direct gain rho and a crossed gain chi on the mirror-symmetric sides,
the sum of both eyes is driven by Kc = rho + chi and their difference by
Kd = rho - chi. Angles and rates in radians; the period comes with each step.
"""

from math import exp

from gazerig.gaze.angles import clip


class LeakyIntegrator:
    """Shared neural integrator: holds, or leaks back to straight ahead with T_N."""

    def __init__(self, hold_s: float) -> None:
        self._hold_s = hold_s

    def step(self, value: float, rate: float, dt_s: float) -> float:
        """Return the integrated value one period later."""
        if self._hold_s == 0.0:
            return value + rate * dt_s
        kept = exp(-dt_s / self._hold_s)
        return kept * value + self._hold_s * (1.0 - kept) * rate


class ConjugateChannel:
    """Velocity command of both eyes together (conjugate) along one axis.

    The delayed retinal error plus the gaze of that moment (efference copy) is where the
    target is in space. That is smoothed and compared with the gaze of now, so that no
    delay remains in the loop; its rate of change is followed as it is.
    """

    def __init__(
        self,
        position_gain_1_s: float,
        velocity_gain: float,
        max_error_rad: float,
        max_speed_rad_s: float,
        reject_rad_s: float,
        smooth_s: float,
        lead_s: float,
        fade_s: float,
    ) -> None:
        self._Kc, self._Gp = position_gain_1_s, velocity_gain
        self._max_error, self._max_speed = max_error_rad, max_speed_rad_s
        self._reject, self._smooth_s = reject_rad_s, smooth_s
        self._lead_s, self._fade_s = lead_s, fade_s
        self.reset()

    def reset(self) -> None:
        """Forget the target."""
        self._seen: float | None = None
        self._smoothed = 0.0
        self.speed_rad_s = 0.0

    def hold(self, target_rad: float | None) -> None:
        """Hold the estimate of the target's velocity during a saccade."""
        if target_rad is not None and self._seen is not None:
            self._smoothed += target_rad - self._seen
            self._seen = target_rad

    def step(self, target_rad: float | None, gaze_rad: float, dt_s: float) -> float:
        """Return the desired velocity; None: no target, the present speed decays."""
        if target_rad is None:
            self.speed_rad_s *= exp(-dt_s / self._fade_s)
            return self._Gp * clip(self.speed_rad_s, self._max_speed)
        self._follow(target_rad, dt_s)
        ahead = self._smoothed + self._lead_s * self.speed_rad_s
        return self._Gp * clip(self.speed_rad_s, self._max_speed) + self._Kc * clip(
            ahead - gaze_rad, self._max_error
        )

    def _follow(self, target_rad: float, dt_s: float) -> None:
        """Low-pass the target's position and differentiate it; a jump is not taken for velocity."""
        if self._seen is None:
            self._smoothed = target_rad
        elif abs(target_rad - self._seen) > self._reject * dt_s:
            self._smoothed += target_rad - self._seen
        self._seen = target_rad
        kept = exp(-dt_s / self._smooth_s)
        smoothed = kept * self._smoothed + (1.0 - kept) * target_rad
        self.speed_rad_s = (smoothed - self._smoothed) / dt_s
        self._smoothed = smoothed


class VergenceChannel:
    """Velocity command of the vergence angle: first order, slower when diverging."""

    def __init__(self, converge_1_s: float, diverge_1_s: float) -> None:
        self._converge, self._diverge = converge_1_s, diverge_1_s

    def step(self, demand_rad: float | None, vergence_rad: float) -> float:
        """Return the rate; None: an eye is covered and the angle is kept."""
        if demand_rad is None:
            return 0.0
        error = demand_rad - vergence_rad
        return (self._converge if error >= 0.0 else self._diverge) * error
