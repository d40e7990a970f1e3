"""Saccades that the eye servo of a rig can make, computed with the emulated servo.

The servo gets the goals of the rig's saccade model at the loop rate, as in a run. Its position is
that of its shaft: play and the rest of the head are left out.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import degrees, radians
from typing import NamedTuple

from gazerig.config.rig import Rig
from gazerig.drivers.errors import DriverError
from gazerig.gaze.oculomotor.saccade import SaccadeModel
from gazerig.robot.app.run_bus import emulated_lines, in_process_run_bus
from gazerig.robot.model.clock import SimulatedClock
from gazerig.sim_mock.devices import PluginLine, build

AMPLITUDES_DEG = (5.0, 10.0, 20.0)
NEAR_DEG = 1.0
_HOLD_S, _LONGEST_S, _MS = 0.6, 1.2, 0.001


class SaccadeTimes(NamedTuple):
    """Times in ms until a saccade stays within 1 deg of its end: the model's, and the servo's.

    servo_ms is None if it takes more than 1.2 s.
    """

    amplitude_deg: float
    model_ms: int
    servo_ms: int | None


def eye_joint(rig: Rig) -> str | None:
    """Return the first joint that pans an eye, None without one."""
    return next((name for name in rig.names if "eye" in name and name.endswith("pan")), None)


def eye_servo_text(rig: Rig) -> str | None:
    """Return in words which saccades the eye servo of a rig can make, None if unknown."""
    joint = eye_joint(rig)
    if joint is None:
        return None
    try:
        times = saccade_times(rig, joint)
    except DriverError:  # a servo that cannot be emulated with these settings
        return None
    if not times:
        return None
    longest = f"more than {_LONGEST_S * 1e3:.0f}"
    sizes = ", ".join(f"{one.amplitude_deg:g}" for one in times)
    model = ", ".join(str(one.model_ms) for one in times)
    servo = ", ".join(longest if one.servo_ms is None else str(one.servo_ms) for one in times)
    return (
        f"{rig.joints[joint].model}, emulated: within 1 deg of {sizes} deg after {servo} ms; "
        f"the model after {model} ms"
    )


def saccade_times(
    rig: Rig, joint: str, amplitudes_deg: Sequence[float] = AMPLITUDES_DEG
) -> list[SaccadeTimes]:
    """Return the times of saccades about the middle of a joint; none for a package's servo.

    Amplitudes that the joint's range does not contain are left out.
    """
    alone = replace(rig, joints={joint: rig.joints[joint]}, couplings={})
    params = rig.joints[joint]
    reach = params.max_deg - params.min_deg
    if any(isinstance(line, PluginLine) for line in emulated_lines(alone).values()):
        return []
    return [_times(alone, joint, one) for one in amplitudes_deg if one <= reach]


def _times(rig: Rig, joint: str, amplitude_deg: float) -> SaccadeTimes:
    params, model = rig.joints[joint], SaccadeModel(rig.gaze.saccade)
    linkage, clock = params.make_linkage(), SimulatedClock()
    middle = 0.5 * (params.min_deg + params.max_deg)
    start, size = radians(middle - 0.5 * amplitude_deg), radians(amplitude_deg)
    lines = emulated_lines(rig)
    run = in_process_run_bus(rig, {n: build(one, clock.now_s) for n, one in lines.items()})
    run.bus.open()
    run.bus.enable_torque()
    period_s = 1.0 / rig.loop.rate_hz
    servo, planned = [], []
    began = clock.now_s() + _HOLD_S
    while clock.now_s() < began + _LONGEST_S:
        since = clock.now_s() - began
        moved = model.profile.displacement_rad(size, since) if since > 0.0 else 0.0
        run.bus.write([round(linkage.steps(start + moved))])
        run.bus.read(clock.now_s())
        until = clock.now_s() + period_s
        while clock.now_s() < until - 0.5 * _MS:
            clock.sleep_until(min(until, clock.now_s() + _MS))
            if clock.now_s() > began:
                at = (run.true_steps or dict)()[joint]
                servo.append(degrees(start + size - linkage.angle_rad(at)))
                planned.append(
                    degrees(size - model.profile.displacement_rad(size, clock.now_s() - began))
                )
    run.bus.close()
    return SaccadeTimes(amplitude_deg, _settled_ms(planned) or 0, _settled_ms(servo))


def _settled_ms(off_deg: Sequence[float]) -> int | None:
    """Return the milliseconds until a distance, given each millisecond, stays below 1 deg."""
    far = [ms for ms, off in enumerate(off_deg, 1) if abs(off) > NEAR_DEG]
    last = far[-1] if far else 0
    return last + 1 if last < len(off_deg) else None
