"""Motion of a person's hands over a round: hanging, in the lap, on guard, and during acts.

A hand is defined by its wrist and the directions of its fingers and palm; the elbow follows.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gazerig.features.world.measures import Measures
from gazerig.features.world.rotations import axes_along, limit_angle, unit
from gazerig.features.world.time_profiles import blend, smooth_rise, there_and_back
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.timeline import TimedAct

FIST_M = 0.07
"""Distance from the wrist to the centre of a hand or fist."""
PUNCH_ENDS_M = 0.30
"""Distance before its target at which a punch stops."""
PUSH_FROM_M, PUSH_BY_M = 0.13, 0.135
_FOREHEAD = np.array((0.0, 0.0, 0.045))


class Frame(NamedTuple):
    """Position of the body at all times, for one arm.

    shoulder_m, hips_m, chin_m: (n, 3); ahead, left: (n, 3) level directions of the body
    side: 1 the left arm, -1 the right one
    """

    shoulder_m: Floats
    hips_m: Floats
    chin_m: Floats
    ahead: Floats
    left: Floats
    side: float
    body: Measures


class HandPose(NamedTuple):
    """Hand poses at all times, rows (n, 3): wrist, directions of the fingers, palm and elbow."""

    wrist_m: Floats
    fingers: Floats
    palm: Floats
    pole: Floats

    def towards(self, other: "HandPose", share: Floats) -> "HandPose":
        """Return the pose between two poses, with a fraction per row."""
        return HandPose(*(blend(a, b, share) for a, b in zip(self, other, strict=True)))


class PostureShares(NamedTuple):
    """Weights of the postures of the hands (n,), 0..1."""

    seated: Floats
    guard: Floats
    holds: Floats


UP = np.array((0.0, 0.0, 1.0))


def _point(frame: Frame, origin: Floats, ahead: float, out: float, up: float) -> Floats:
    """Return a point near an origin; ``out`` is to the arm's own side."""
    return np.asarray(origin + ahead * frame.ahead + out * frame.side * frame.left + up * UP)


def _direction(frame: Frame, ahead: float, out: float, up: float) -> Floats:
    return np.asarray(ahead * frame.ahead + out * frame.side * frame.left + up * UP)


def resting_pose(frame: Frame, held: PostureShares, swing_rad: Floats, boxes: bool) -> HandPose:
    """Return the pose of an idle hand: hanging, swinging, in the lap, holding, or guarding."""
    arm = frame.body.arm_m
    swing = swing_rad[:, None]
    down = 0.965 * arm * (np.sin(swing) * frame.ahead - np.cos(swing) * UP)
    hanging = HandPose(
        frame.shoulder_m + down + 0.05 * frame.side * frame.left + 0.03 * frame.ahead,
        unit(down) + 0.12 * frame.ahead,
        _direction(frame, -0.25, -1.0, 0.0),
        _direction(frame, -1.0, 0.35, 0.0),
    )
    thigh = 0.68 * frame.body.thigh_m
    lap = HandPose(
        _point(frame, frame.hips_m, thigh, 0.7 * frame.body.half_hips_m + 0.03, 0.115),
        _direction(frame, 1.0, -0.45, -0.15),
        _direction(frame, 0.1, -0.1, -1.0),
        _direction(frame, -0.6, 1.0, -0.3),
    )
    ahead = (0.30 if frame.side > 0 else 0.24) if boxes else 0.27
    guard = HandPose(
        _point(frame, frame.chin_m, ahead - 0.06, 0.125, -0.235),
        _direction(frame, 0.55, -0.10, 0.85),
        _direction(frame, -0.35, -1.0, 0.1),
        _direction(frame, 0.0, 0.35, -1.0),
    )
    chest = frame.shoulder_m - frame.side * frame.body.half_shoulders_m * frame.left
    holding = HandPose(
        _point(frame, chest, 0.30, 0.16, -0.28),
        _direction(frame, 1.0, -0.55, 0.1),
        _direction(frame, 0.3, -1.0, 0.0),
        _direction(frame, -0.4, 0.7, -1.0),
    )
    return hanging.towards(lap, held.seated).towards(holding, held.holds).towards(guard, held.guard)


def _oscillation(t_s: Floats, start_s: float, rate_hz: float, phase: float) -> Floats:
    return np.sin(2.0 * np.pi * rate_hz * (t_s - start_s) + phase)[:, None]


def act_pose(frame: Frame, one: TimedAct, t_s: Floats, target: Floats, now: HandPose) -> HandPose:
    """Return the poses of a hand in an act.

    Args:
        frame: position of the body.
        one: the act.
        t_s: times of the rows.
        target: its target (n, 3).
        now: poses of the hand without it.
    """
    shoulder, aside = frame.shoulder_m, frame.side * frame.left
    to = unit(target - shoulder)
    level = unit((target - shoulder) * (1.0, 1.0, 0.0))
    match one.act.do:
        case "wave":
            swing = _oscillation(t_s, one.start_s, 1.5, 0.0)
            wrist = shoulder + 0.24 * level + (0.15 + 0.09 * swing) * aside + 0.10 * UP
            return HandPose(wrist, UP + 0.35 * swing * aside, level, 0.7 * aside - UP)
        case "gesture":
            phase = 0.9 * frame.side
            beat = _oscillation(t_s, one.start_s, 1.3, phase)
            slow = _oscillation(t_s, one.start_s, 0.45, 2.0 * phase)
            wrist = _point(frame, shoulder, 0.27, 0.02, -0.27)
            wrist = wrist + (0.035 * beat + 0.025 * slow) * UP + 0.05 * slow * aside
            return HandPose(
                wrist,
                _direction(frame, 1.0, -0.15, 0.35),
                _direction(frame, 0.1, -0.8, 0.5),
                _direction(frame, -0.2, 0.6, -1.0),
            )
        case "point":
            wrist = shoulder + 0.94 * frame.body.arm_m * to
            palm = _direction(frame, 0.0, -0.4, -1.0)
            return HandPose(wrist, to, palm, _direction(frame, 0.0, 0.4, -1.0))
        case "reach":
            palm = _direction(frame, 0.1, -0.7, -0.8)
            return HandPose(target - FIST_M * to, to, palm, _direction(frame, 0.0, 0.6, -1.0))
        case "pass":
            fingers = unit(to * (1.0, 1.0, 0.2) + 0.3 * frame.ahead)
            palm = _direction(frame, 0.2, -1.0, 0.0)
            return HandPose(target - FIST_M * to, fingers, palm, _direction(frame, 0.0, 0.7, -1.0))
        case "push":
            lasts_s = one.end_s - one.start_s
            begins_s, each_s = one.start_s + 0.35 * lasts_s, 0.25 * lasts_s
            press = there_and_back(t_s, begins_s, each_s, 0.1, each_s)
            middle = target + _FOREHEAD - level * (PUSH_FROM_M - PUSH_BY_M * press[:, None])
            fingers = unit(UP + 0.6 * level)
            pole = _direction(frame, 0.0, 0.7, -1.0)
            return HandPose(middle - FIST_M * fingers, fingers, level - 0.4 * UP, pole)
        case "punch":
            return _punch(frame, target - PUNCH_ENDS_M * to - FIST_M * to, to)
        case "feint":
            return now._replace(wrist_m=_point(frame, now.wrist_m, 0.06, 0.15, 0.05))
        case _:  # an open guard
            return HandPose(
                _point(frame, shoulder, 0.20, 0.14, -0.36),
                _direction(frame, 0.9, -0.1, 0.1),
                _direction(frame, 0.0, -1.0, -0.2),
                _direction(frame, -0.8, 0.6, -0.8),
            )


def _punch(frame: Frame, wrist_m: Floats, to: Floats) -> HandPose:
    palm = _direction(frame, 0.0, -0.2, -1.0)
    return HandPose(wrist_m, to, palm, _direction(frame, 0.0, 0.6, -0.8))


def fist_pose(frame: Frame, wrist_m: Floats, out: Floats) -> HandPose:
    """Return a fist at a position, from the guard (out 0) to a stretched punch (out 1), (n,)."""
    one = np.ones(len(wrist_m))
    guard = resting_pose(frame, PostureShares(0.0 * one, one, 0.0 * one), 0.0 * one, boxes=True)
    punch = _punch(frame, wrist_m, unit(wrist_m - frame.shoulder_m))
    return guard._replace(wrist_m=wrist_m).towards(punch, out)


OUT_S: Mapping[str, tuple[float, float]] = {
    "punch": (0.42, 0.5),
    "feint": (0.5, 0.5),
    "push": (0.34, 0.34),
    "open_guard": (0.25, 0.25),
    "wave": (0.2, 0.2),
    "gesture": (0.2, 0.2),
    "point": (0.28, 0.3),
    "reach": (0.28, 0.25),
    "pass": (0.34, 0.34),
}
"""Fractions of an act's time for the motion of the hand out and back."""


def act_share(one: TimedAct, t_s: Floats) -> Floats:
    """Return the progress of a hand from rest to the pose of an act (n,), 0..1."""
    lasts_s = one.end_s - one.start_s
    out, back = (min(1.2, share * lasts_s) for share in OUT_S[one.act.do])
    if one.act.do in ("wave", "gesture", "reach", "point"):
        out, back = min(out, 0.7), min(back, 0.8)
    return there_and_back(t_s, one.start_s, out, lasts_s - out - back, back)


def hand_pose(
    frame: Frame, t_s: Floats, acts: Sequence[TimedAct], at: Sequence[Floats], rest: HandPose
) -> HandPose:
    """Return the poses of a hand over a round; ``at``: (n, 3) target of each act of this arm."""
    now = rest
    for one, target in zip(acts, at, strict=True):
        share = act_share(one, t_s)
        now = now.towards(act_pose(frame, one, t_s, target, now), share)
        # A raised hand passes in front of the body, not through it.
        wide = 0.12 if one.act.do not in ("punch", "feint") else 0.0
        bow = wide * 4.0 * share * (1.0 - share) * (1.0 - 0.5 * smooth_rise(share))
        now = now._replace(wrist_m=now.wrist_m + bow[:, None] * frame.ahead)
    return now


def moves_arm(one: TimedAct) -> bool:
    """Return whether an act moves a hand."""
    return one.act.do in OUT_S


def twist_rad(t_s: Floats, acts: Sequence[TimedAct]) -> Floats:
    """Return the turn of the chest to the left due to the acts of the hands (n,)."""
    total = np.zeros_like(t_s)
    for one in acts:
        if one.act.do in ("punch", "reach", "push", "point"):
            most = 0.45 if one.act.do == "punch" else 0.2
            total += most * (1.0 if one.act.side == "right" else -1.0) * act_share(one, t_s)
    return total


def lean_rad(
    t_s: Floats, acts: Sequence[TimedAct], at: Sequence[Floats], chest_m: Floats, body: Measures
) -> Floats:
    """Return the forward lean of the chest that brings the hands to their targets (n,)."""
    total = np.zeros_like(t_s)
    for one, target in zip(acts, at, strict=True):
        if one.act.do in ("reach", "push", "pass"):
            short = {"push": PUSH_FROM_M - PUSH_BY_M}.get(one.act.do, 0.0)
            away = np.linalg.norm(target - chest_m, axis=1) - short - FIST_M - 0.86 * body.arm_m
            needed = np.clip(away / (0.26 * body.stature_m), 0.0, 0.75)
            total += act_share(one, t_s) * needed
        elif one.act.do == "punch":
            total += 0.10 * act_share(one, t_s)
        elif one.act.do == "open_guard":
            total -= 0.04 * act_share(one, t_s)
    return total


def hand_axes(hand: HandPose, elbow_m: Floats, wrist_m: Floats) -> Floats:
    """Return rotations of a hand: x out of the palm, z from the fingers to the wrist."""
    along = unit(wrist_m - elbow_m)
    fingers = limit_angle(unit(hand.fingers), along, np.radians(55.0))
    return axes_along(-fingers, hand.palm)
