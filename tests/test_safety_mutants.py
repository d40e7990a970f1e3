"""The guard broken on purpose, one check at a time: each time something here must notice.

Every mutation replaces one piece of the guard's source, which has to be there exactly once,
and names the check that notices. The same checks pass on the guard as it is.
"""

from collections.abc import Callable
from types import ModuleType

import pytest
from guard_bench import PARTS, built
from guard_checks import (
    acceleration,
    easily,
    gentle,
    hot,
    late,
    late_while_gentle,
    limp,
    no_overshoot,
    not_finite,
    not_moving,
    overloaded,
    range_and_braking,
    rearmed,
    reckoned,
    slow_host,
    slower_in_flight,
    speed,
    stale_joints,
    stale_picture,
    stopped_loop,
    torque_off,
    voltage,
)
from guard_collision_checks import (
    collision,
    collision_braking,
    collision_lag,
    collision_start,
    slow_joint,
)

CHECKS: tuple[Callable[[ModuleType], None], ...] = (
    range_and_braking,
    speed,
    acceleration,
    easily,
    no_overshoot,
    stopped_loop,
    late,
    late_while_gentle,
    slow_host,
    not_finite,
    stale_joints,
    stale_picture,
    hot,
    overloaded,
    voltage,
    not_moving,
    reckoned,
    torque_off,
    limp,
    rearmed,
    gentle,
    slower_in_flight,
    collision,
    collision_braking,
    collision_lag,
    collision_start,
    slow_joint,
)

MOTION, HEALTH, COLLISIONS, GUARD = PARTS
Mutation = tuple[str, str, str, Callable[[ModuleType], None]]
MUTATIONS: tuple[Mutation, ...] = (
    # position, and the way to brake before its end
    (
        MOTION,
        "desired + brake > self.high[i]",
        "desired + brake > self.high[i] + 0.1",
        range_and_braking,
    ),
    (
        MOTION,
        "desired - brake < self.low[i]",
        "desired - brake < self.low[i] - 0.1",
        range_and_braking,
    ),
    (MOTION, "brake = 0.5 * wanted", "brake = 0.3 * wanted", range_and_braking),
    (
        MOTION,
        "up = min(top, reachable_speed(high - p, accel, dt_s))",
        "up = top",
        range_and_braking,
    ),
    (
        MOTION,
        "down = -min(top, reachable_speed(p - low, accel, dt_s))",
        "down = -top",
        range_and_braking,
    ),
    (MOTION, "2.0 * accel * max(", "2.2 * accel * max(", range_and_braking),
    (GUARD, "if abs(desired - target) > _ROUNDING_RAD:", "if False:", range_and_braking),
    # speed
    (MOTION, "-top <= wanted <= top and", "wanted <= top and", speed),
    (MOTION, "-top <= wanted <= top and", "-top <= wanted and", speed),
    (MOTION, "up = min(top, reach", "up = min(2.0 * top, reach", speed),
    (MOTION, "down = -min(top, reach", "down = -min(2.0 * top, reach", speed),
    # acceleration
    (MOTION, "v - step <= wanted <= v + step", "v - step <= wanted", acceleration),
    (MOTION, "v - step <= wanted <= v + step", "wanted <= v + step", acceleration),
    (MOTION, "step, top = accel * dt_s,", "step, top = 1.2 * accel * dt_s,", acceleration),
    (MOTION, "most if wanted > most else", "1.1 * most if wanted > most else", acceleration),
    (MOTION, "least if wanted < least else", "1.1 * least if wanted < least else", acceleration),
    (MOTION, "return v + soft * dt_s", "return v + 1.1 * soft * dt_s", gentle),
    (MOTION, "chosen = max(up, v - accel * dt_s)", "chosen = up", slower_in_flight),
    (MOTION, "chosen = min(down, v + accel * dt_s)", "chosen = down", slower_in_flight),
    # slow joints far from their ends, which are checked in one go
    (MOTION, "0.49 * limit.accel_rad_s2", "1.9 * limit.accel_rad_s2", acceleration),
    (GUARD, "-easy <= v <= easy and ", "", easily),
    (GUARD, "-easy <= wanted <= easy and ", "", acceleration),
    (MOTION, "self.low[i] + room", "self.low[i] - 0.1", easily),
    (MOTION, "self.high[i] - room", "self.high[i] + 0.1", easily),
    (GUARD, "if not motion.easy_s <= dt_s <= 2.0 * motion.easy_s:", "if False:", easily),
    (MOTION, "self.easy_s = 0.9 * dt_s", "self.easy_s = 3.0 * dt_s", easily),
    # catching up
    (MOTION, "-step * dt_s <= self.goal[i] - p <= step * dt_s", "True", no_overshoot),
    (
        MOTION,
        "closing = reachable_speed(abs(gap), soft, dt_s)",
        "closing = abs(gap) / dt_s",
        no_overshoot,
    ),
    # time
    (MOTION, "return pace_s, since_s", "return since_s, since_s", stopped_loop),
    (MOTION, "return pace_s, since_s", "return since_s, since_s", late),
    (MOTION, "        recent_s.append(since_s)\n        if", "        if", slow_host),
    (MOTION, "self.soft_until_s = t_s + soft_s", "pass", late),
    (GUARD, "            self._motion.record_gap(missed_s)", "            pass", late),
    (GUARD, "soft = min(soft, self._late_accel)", "pass", late),
    (MOTION, "- limit.accel_rad_s2 * for_s", "", late),
    (MOTION, "min(lost, v + regain * dt_s)", "v", late_while_gentle),
    (MOTION, "min(lost, v + regain * dt_s)", "v + regain * dt_s", late_while_gentle),
    (MOTION, "min(lost, v + regain * dt_s)", "lost", late_while_gentle),
    (MOTION, "short = for_s <= SHORT_GAP_S", "short = True", late_while_gentle),
    (GUARD, "since_s > 0.0 and isfinite(since_s)", "isfinite(since_s)", stopped_loop),
    (GUARD, "since_s > 0.0 and isfinite(since_s)", "since_s > 0.0", stopped_loop),
    # numbers and ages
    (GUARD, "if not isfinite(desired):", "if False:", not_finite),
    (GUARD, "near and at_s >= stale_s and", "near and", stale_joints),
    (GUARD, "        if not fresh:", "        if False:", stale_joints),
    (GUARD, "fresh = fresh and isfinite(position)", "pass", stale_joints),
    (GUARD, "(no_frame and self._neck[i])\n            or", "", stale_picture),
    (
        GUARD,
        "self._are_all_well(joints) and not no_frame",
        "self._are_all_well(joints)",
        stale_picture,
    ),
    (GUARD, '_Hold("stale frame") if unseen else None', "None", stale_picture),
    (GUARD, "no_frame = not frame_age_s <=", "no_frame = frame_age_s >", stale_picture),
    # heat
    (HEALTH, "self._hot[i] = celsius >= (", "self._hot[i] = celsius >= 99.0 + (", hot),
    (HEALTH, "hot - _COOLER_C if", "hot if", hot),
    (HEALTH, "(hot - celsius) / (hot - warm)", "1.0", hot),
    (HEALTH, '"hot" if self._hot[i] else', "", hot),
    (GUARD, '_Hold(strain, restart="slowly") if strain else None', "None", hot),
    (GUARD, "top, soft = share * limit.speed_rad_s,", "top, soft = limit.speed_rad_s,", hot),
    (GUARD, "or self._health.share[i] < 1.0", "", hot),
    (GUARD, "not self._health.fine", "False", hot),
    # load
    (HEALTH, "filled >= (0.5 if self._overloaded[i] else 1.0)", "False", overloaded),
    (HEALTH, "2.0 - 2.0 * filled", "1.0", overloaded),
    (HEALTH, "gained = (load * load -", "gained = (load -", overloaded),
    (HEALTH, "and min(load) >= -lasting)", ")", overloaded),
    (GUARD, 'if strain == "overloaded":', "if False:", overloaded),
    # voltage
    (HEALTH, "volts - self._limits[i].lowest_v", "9.9", voltage),
    (HEALTH, "self._limits[i].highest_v - volts", "9.9", voltage),
    (HEALTH, "outside_s >= self._outside_full_s and", "False and", voltage),
    (HEALTH, "max(room / self._params.voltage_margin_v, 0.0)", "1.0", voltage),
    # jams
    (HEALTH, "if at_s - self._since_s[i] < self._stuck_s:", "if True:", not_moving),
    (HEALTH, "-self.far_rad <= lead <= self.far_rad", "-self.far_rad <= lead", not_moving),
    (HEALTH, "-self.far_rad <= lead <= self.far_rad", "lead <= self.far_rad", not_moving),
    (HEALTH, "* side > self._moved_rad", "* side > 9.9", not_moving),
    (
        HEALTH,
        "(position - self._anchor_rad[i]) * side >",
        "abs(position - self._anchor_rad[i]) >",
        not_moving,
    ),
    (HEALTH, "self._until_s[i] = t_s + self._retry_s", "self._until_s[i] = t_s", not_moving),
    (GUARD, "not watched", "True", not_moving),
    (GUARD, "near = -far <= p - position <= far and", "near =", not_moving),
    (GUARD, "if joints.measured and not joints.measured[i]:", "if False:", reckoned),
    (GUARD, "self._retreat[i] = back = position", "pass", not_moving),
    (GUARD, "if self._retrying[i]:\n", "if False:\n", not_moving),
    # torque and faults
    (GUARD, "        if not powered:", "        if False:", torque_off),
    (GUARD, "or not all(joints.torque)", "", torque_off),
    (GUARD, "position if isfinite(position) else None, restart", "None, restart", torque_off),
    (GUARD, "return (3, fault) if fault else (rank, reason)", "return (rank, reason)", limp),
    (GUARD, "or any(joints.fault)", "", limp),
    (GUARD, 'if "encoder" in fault:', "if False:", limp),
    (GUARD, "if fault:  #", "if False:  #", limp),
    (GUARD, "if any(joints.rearmed):", "if False:", rearmed),
    (GUARD, "self._calm = followed", "self._calm = True", gentle),
    (MOTION, "        self.speed[i] = 0.0\n", "", rearmed),
    # slow passages
    (MOTION, "top = min(top, self.limits[i].speed_rad_s)", "pass", slow_joint),
    (MOTION, "soft = min(soft, self.limits[i].accel_rad_s2)", "pass", slow_joint),
    (GUARD, "min(top, self._gentle_speed)", "top", gentle),
    (GUARD, "min(accel, self._gentle_accel)", "accel", gentle),
    (GUARD, "and self._t_s >= self._gentle_until_s[i]", "or True", gentle),
    # collisions
    (COLLISIONS, "motion.wall_above(i, span.below)", "pass", collision),
    (COLLISIONS, "motion.wall_below(i, span.above)", "pass", collision),
    (MOTION, "self.high[i] = min(self.high[i], wall_rad)", "pass", collision),
    (MOTION, "self.low[i] = max(self.low[i], wall_rad)", "pass", collision),
    (
        COLLISIONS,
        "self._keeper[k] = keeper\n        _put_wall(pair[keeper], motion)",
        "pass",
        collision,
    ),
    (
        COLLISIONS,
        "eager = _crosses(pair[keeper], motion, desired)",
        "eager = False",
        collision,
    ),
    (
        COLLISIONS,
        "if not _present_side(pair[keeper], motion):\n            keeper",
        "if False:\n            keeper",
        collision_start,
    ),
    (
        MOTION,
        "stop = p + 0.5 * v * v / self.limits[i].accel_rad_s2 if v > 0.0 else p",
        "stop = p",
        collision_braking,
    ),
    (
        MOTION,
        "stop = p - 0.5 * v * v / self.limits[i].accel_rad_s2 if v < 0.0 else p",
        "stop = p",
        collision_braking,
    ),
    (COLLISIONS, "and _is_outside(other, position)", "", collision_lag),
    (COLLISIONS, "                _put_wall(other, motion)", "                pass", collision_lag),
    (GUARD, "if i in self._collisions.exits:", "if False:", collision_start),
    (GUARD, "if i in self._collisions.still:", "if False:", collision_start),
    (GUARD, "is_slow=True, ", "", collision_start),
    (
        COLLISIONS,
        "_, joint, exit_rad = min(paths)",
        "_, joint, exit_rad = max(paths)",
        collision_start,
    ),
)


@pytest.mark.parametrize("check", CHECKS, ids=[check.__name__ for check in CHECKS])
def test_the_guard_as_it_is_passes(check: Callable[[ModuleType], None]) -> None:
    check(built())


@pytest.mark.parametrize(
    ("part", "old", "new", "check"),
    MUTATIONS,
    ids=[f"{check.__name__}: {old.strip()} -> {new.strip()}" for _, old, new, check in MUTATIONS],
)
def test_a_broken_guard_is_noticed(
    part: str, old: str, new: str, check: Callable[[ModuleType], None]
) -> None:
    broken = built(part, old, new)
    with pytest.raises(Exception) as noticed:
        check(broken)
    assert isinstance(
        noticed.value, AssertionError | ValueError | OverflowError | ZeroDivisionError
    )


def test_every_check_has_broken_guards_to_notice() -> None:
    assert {check for _, _, _, check in MUTATIONS} == set(CHECKS)
