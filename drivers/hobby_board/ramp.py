"""Estimate of a channel's pulse and of its servo's shaft, from known speeds.

A pulse moves towards its goal at a limited speed and acceleration, ramped by the board or by the
driver. The servo's shaft follows the pulse at its own speed. The shaft is not measured: the result
is an estimate, which is wrong for a stuck or loaded servo. Steps are quarter microseconds.
"""

from math import ceil, sqrt

_SLICE_S = 0.005
_LONG_S = 5.0
"""Time after which any pulse has arrived."""


class Ramp:
    """Ramp of one channel's pulse and shaft.

    pulse_steps: present pulse; shaft_steps, shaft_steps_s: estimated position and speed of the
        servo
    speed_steps_s, accel_steps_s2: limits of the pulse; 0: unlimited
    shaft_speed_steps_s: speed of the servo itself
    """

    def __init__(self, place_steps: float, shaft_speed_steps_s: float) -> None:
        self.shaft_speed_steps_s = shaft_speed_steps_s
        self.speed_steps_s = self.accel_steps_s2 = 0.0
        self.shaft_steps = place_steps
        self.begin(place_steps)

    def begin(self, pulse_steps: float) -> None:
        """Record that pulses begin, or already are, at a width; the shaft does not move."""
        self.pulse_steps = pulse_steps
        self.shaft_steps_s = 0.0
        self._pulse_steps_s = 0.0

    def stop(self) -> None:
        """Record that there are no pulses: the shaft is assumed not to move."""
        self.begin(self.shaft_steps)

    def found(self, pulse_steps: float) -> None:
        """Record the width that the board reports."""
        self.pulse_steps = pulse_steps

    def longest_s(self, way_steps: float) -> float:
        """Return a time within which a pulse has moved this distance from rest, seconds."""
        speed, accel = self.speed_steps_s, self.accel_steps_s2
        cruise_s = way_steps / speed if speed else 0.0
        return cruise_s + (2.0 * sqrt(way_steps / accel) if accel else 0.0)

    def move(self, goal_steps: float, for_s: float) -> None:
        """Advance the pulse and the shaft towards a goal."""
        if for_s <= 0.0:
            return
        if self.pulse_steps == goal_steps == self.shaft_steps:
            self._pulse_steps_s = self.shaft_steps_s = 0.0
            return
        pulse, shaft, slices = self.pulse_steps, self.shaft_steps, 1
        if for_s <= _LONG_S:
            slices = ceil(for_s / _SLICE_S)
        slice_s = for_s / slices
        limit, accel, pulse_steps_s = self.speed_steps_s, self.accel_steps_s2, self._pulse_steps_s
        at_once = slice_s > _LONG_S or not (limit or accel)
        reach = self.shaft_speed_steps_s * slice_s
        for _ in range(slices):
            left = goal_steps - pulse
            if at_once or left == 0.0:
                pulse, pulse_steps_s = goal_steps, 0.0
            else:
                way, far = (1.0, left) if left > 0.0 else (-1.0, -left)
                speed = limit or far / slice_s
                if accel:
                    towards = max(0.0, way * pulse_steps_s)
                    speed = min(speed, towards + accel * slice_s, sqrt(2.0 * accel * far))
                if speed * slice_s >= far:
                    pulse, pulse_steps_s = goal_steps, way * far / slice_s
                else:
                    pulse += way * speed * slice_s
                    pulse_steps_s = way * speed
            shaft += min(reach, max(-reach, pulse - shaft))
        self.shaft_steps_s = (shaft - self.shaft_steps) / for_s
        self.pulse_steps, self.shaft_steps, self._pulse_steps_s = pulse, shaft, pulse_steps_s
