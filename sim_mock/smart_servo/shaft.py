"""The shaft of an emulated servo: profile, controller, motor, friction and stops.

Units: steps of an encoder with 4096 per turn, milliseconds; torque is a share of the stall torque
at the rated voltage, duty a share of full PWM. The encoder is at the output: play between shaft
and joint shows only in a world, where the joint moves. Steps of 1 ms are implicit: P and D act on
position and speed at their end, because the real loop, much faster than 1 kHz, acts during the
step. So no gain of the registers makes the numbers diverge, and readings do not change the motion.
"""

from collections.abc import Callable
from math import sqrt

from gazerig.sim_mock.smart_servo.physics import DISABLED, Loop, Motor, Physics, mechanics_of

SMOOTHING = 0.25
"""Share of the profile's new speed that D adopts in 1 ms: any servo must smooth differences
between milliseconds; the time of 4 ms is assumed."""
SLOWEST = 1e-4
"""Lower reference speeds, in steps/ms, count as 0."""
RESOLUTION = 0.5
"""Resolution of the encoder in steps: the integrator is constant within this error."""
LEAST_WEIGHT = 1e-4
"""Smallest change of the weight that counts, so that a shaft at rest remains so."""


def whole_ms(now_s: float) -> int:
    """Return the whole milliseconds of a time; the margin keeps 0.005 s from being 4 ms."""
    return int(now_s * 1000.0 + 1e-3)


class Shaft:
    """Position and speed of one output shaft, advanced in whole milliseconds.

    The profile to a goal is that of the e-Manual of Dynamixel X ("What is the Profile"): from its
    present speed it accelerates to the cruise speed and brakes to stop at the goal.

    x, v: position in steps and speed in steps/ms, as the encoder would measure them, unrounded
    u, effort: PWM and torque (proportional to current) as shares
    goal, r, r_v: end of the profile, its position and its speed now
    led: whether the profile has not reached its end
    quiet: nothing will change until a write or a push by hand
    """

    __slots__ = (
        "_built", "_cruise", "_high", "_integral", "_load", "_loop", "_low", "_ramp", "_rv",
        "_stops", "_weight",
        "effort", "goal", "led", "quiet", "r", "r_v", "u", "v", "x",
    )  # fmt: skip

    _integral: float

    def __init__(self, motor: Motor, physics: Physics, position_steps: float) -> None:
        self._built = mechanics_of(motor, physics)
        self._weight = self._load = 0.0
        self._stops = self._low, self._high = physics.stop_low_steps, physics.stop_high_steps
        self._loop, self._cruise, self._ramp = DISABLED, 0.0, 0.0
        self.place(position_steps)

    # --- external events

    def resume(self) -> None:
        """Continue from the present state after any change."""
        self.quiet = False

    def place(self, position_steps: float) -> None:
        """Place the shaft at rest between its stops; profile and controller continue from there."""
        low, high = self._stops
        self.x = min(max(float(position_steps), low), high)
        self.v = self.u = self.effort = 0.0
        self.start()

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, up to its stops; the controller remains active."""
        self.x = min(max(self.x + steps, self._low), self._high)
        self.resume()

    def jam(self, stuck: bool) -> None:
        """Jam the joint at its position, or free it."""
        self._low, self._high = (self.x, self.x) if stuck else self._stops
        self.resume()

    def set_weight(self, share: float) -> None:
        """Set the torque of the weight on the joint as a share of the stall torque."""
        if abs(share - self._weight) > LEAST_WEIGHT:
            self._weight, self._load = share, self._built.accel * share
            self.resume()

    # --- calls of the servo

    def drive(self, loop: Loop) -> None:
        """Apply controller settings."""
        if loop != self._loop:
            self._loop = loop
            self._integral = max(-loop.u_max, min(loop.u_max, self._integral))
            self.resume()

    def start(self) -> None:
        """Rest at the present position with an empty integrator, as when it is switched on."""
        self._integral = 0.0
        self.hold()

    def disable(self) -> None:
        """Switch off: the motor has no current and does not brake."""
        self.drive(DISABLED)
        self.u = self.effort = 0.0
        self.start()

    def hold(self) -> None:
        """End the profile at the present position."""
        self.goal = self.r = self.x
        self.r_v = self._rv = 0.0
        self.led = False
        self.resume()

    def lead_to(self, goal: float, cruise: float, ramp: float) -> None:
        """Start the profile to a goal; the same one changes nothing.

        Args:
            goal: its end.
            cruise: speed, steps/ms; 0: jump.
            ramp: acceleration, steps/ms2; 0: without ramps.
        """
        if goal != self.goal or cruise != self._cruise or ramp != self._ramp:
            self.goal, self._cruise, self._ramp = goal, cruise, ramp
            self.led, self.quiet = True, False

    # --- time

    def lead(self, ms: int) -> list[float]:
        """Advance the profile; return its position after each millisecond."""
        if not self.led:
            return [self.goal] * ms
        path: list[float] = []
        goal, cruise, ramp = self.goal, self._cruise, self._ramp
        r, v, ramped = self.r, self.r_v, ramp > 0.0 < cruise
        for _ in range(ms):
            ahead, speed, after = goal - r, v, cruise
            if ahead < 0.0:
                ahead, speed = -ahead, -v
            if ramped:
                # From the speed ``after`` this millisecond it can just stop at the goal.
                square = ramp * (ramp + 4.0 * (2.0 * ahead - speed))
                after = 0.5 * (sqrt(square) - ramp) if square > 0.0 else 0.0
                if after > cruise:
                    after = cruise
                if after > speed + ramp:
                    after = speed + ramp
                elif after < speed - ramp:
                    after = speed - ramp
                way = 0.5 * (speed + after)
                done = after <= 0.0 and speed <= ramp and 2.0 * ahead <= speed
            else:
                way, done = cruise, not 0.0 < cruise < ahead
            if done:
                r, v, self.led = goal, 0.0, False
                path += [goal] * (ms - len(path))
                break
            if goal >= r:
                r, v = r + way, after
            else:
                r, v = r - way, -after
            path.append(r)
        self.r, self.r_v = r, v
        return path

    def run(self, ms: int) -> None:
        """Advance by a number of milliseconds."""
        kp, ki, kd, most, slew = self._loop
        accel, drag, free, dry, rate, _ = self._built
        if self._loop == DISABLED:  # the motor has no current
            drag, rate = free, 0.0
        x, v, u, i, rv = self.x, self.v, self.u, self._integral, self._rv
        low, high, load, before = self._low, self._high, self._load, self.r
        # Without a speed to follow, D only brakes.
        kr = kd if self._cruise else 0.0
        k = kp + kd
        divisor, least, smoothing = drag + accel * k, -most, SMOOTHING
        was, clipped = (x, v, i), False
        for r in self.lead(ms):
            rv += (r - before - rv) * smoothing
            before = r
            c = kp * (r - x) + kr * rv + i
            pull = v + load
            w = pull + accel * c
            # Dry friction stops what the torque of 1 ms cannot move.
            if w > dry:
                v = (w - dry) / divisor
            elif w < -dry:
                v = (w + dry) / divisor
            else:
                v = 0.0
            earlier, u = u, c - k * v
            clipped = not (least <= u <= most and -slew <= u - earlier <= slew)
            if clipped:
                if u > earlier + slew:
                    u = earlier + slew
                elif u < earlier - slew:
                    u = earlier - slew
                u = most if u > most else least if u < least else u
                w = pull + accel * u
                v = (w - dry) / drag if w > dry else (w + dry) / drag if w < -dry else 0.0
            x += v
            if not low <= x <= high:
                x, v = high if x > high else low, 0.0
                u = min(max(c, earlier - slew, least), earlier + slew, most)
            if ki and not clipped and abs(r - x) > RESOLUTION:
                i = min(max(i + ki * (r - x), least), most)
        self.x, self.v, self.u, self._integral = x, v, u, i
        self._rv = 0.0 if -SLOWEST < rv < SLOWEST else rv
        self.effort = u - v * rate
        self.quiet = not (v or self._rv or self.led or clipped) and was == (x, v, i)


ShaftMaker = Callable[[int, Motor, Physics, float], Shaft]
"""Creates the shaft of a servo from its id, motor, physics and first position in steps."""


def create_shaft(servo_id: int, motor: Motor, physics: Physics, position_steps: float) -> Shaft:
    """Return an independent shaft: only its own load acts on it."""
    return Shaft(motor, physics, position_steps)
