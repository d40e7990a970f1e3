"""Motion of a person's head, eyes, lids and lips over a round.

The eyes jump to a target and the head follows more slowly, so the eyes turn back in the head
meanwhile. People scan the face that they look at, and blink about 15 times a minute.
"""

from collections.abc import Mapping, Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from gazerig.features.world.rotations import limit_angle, pitch_of, wrap_angle, yaw_of
from gazerig.features.world.time_profiles import (
    moving_average,
    periodic,
    smooth_bump,
    smooth_rise,
    there_and_back,
)
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.timeline import TimedAct

HEAD_YAW_RAD, HEAD_UP_RAD, HEAD_DOWN_RAD = radians(70.0), radians(45.0), radians(50.0)
EYE_RAD = radians(38.0)
LID_SHUT_RAD = radians(46.0)
"""Rotation of an upper lid down to the lower one."""

_SACCADE_S, _HEAD_LATER_S = 0.06, 0.16
_EASED_ROWS = 24
"""Rows over which a head's turns are averaged, because a head is heavy."""
_HEAD_S, _HEAD_S_PER_RAD = 0.30, 0.25
_OTHERS_SHARE = 0.8
_WANDER_RAD = radians(2.2)
_BLINK_MEAN_S, _BLINK_LEAST_S = 3.2, 0.8
_SYLLABLES_HZ = 4.5


class LookAngles(NamedTuple):
    """Direction of head and eyes, one row per time.

    yaw, pitch: of the head in the world, rad; p_m: (n, 3) gaze target
    wander: (n, 2) offset of the gaze from the target in yaw and pitch, rad
    """

    yaw: Floats
    pitch: Floats
    p_m: Floats
    wander: Floats


def look_angles(
    t_s: Floats,
    acts: Sequence[TimedAct],
    first: Floats,
    targets: Mapping[str, Floats],
    eyes_m: Floats,
    body_yaw: Floats,
    robot: str,
    rng: np.random.Generator,
) -> LookAngles:
    """Return the gaze of a person over a round.

    Args:
        t_s: times of the rows (n,).
        acts: acts of the person; only those that look are used.
        first: (n, 3) gaze target before the first of them.
        targets: (n, 3) positions of the gaze targets, by name.
        eyes_m: (n, 3) approximate positions of the eyes.
        body_yaw: direction of the chest (n,), unwrapped, rad.
        robot: name of the target that the head turns to fully; it turns 0.8 of the angle to others.
        rng: random numbers for the wandering of the gaze.
    """
    found = [one for one in acts if one.act.do == "look_at"]
    start = targets[found[-1].act.to] if found else first
    before = found[-1].act.to == robot if found else True
    yaw, pitch = _turn_to_target(start, before, eyes_m, body_yaw)
    p_m = start
    for one in found:
        target = targets[one.act.to]
        new_yaw, new_pitch = _turn_to_target(target, one.act.to == robot, eyes_m, body_yaw)
        row = min(len(t_s) - 1, int(np.searchsorted(t_s, one.start_s)))
        far = float(abs(wrap_angle(new_yaw[row] - yaw[row])) + abs(new_pitch[row] - pitch[row]))
        share = smooth_rise((t_s - one.start_s - _HEAD_LATER_S) / (_HEAD_S + _HEAD_S_PER_RAD * far))
        yaw = yaw + share * wrap_angle(new_yaw - yaw)
        pitch = pitch + share * (new_pitch - pitch)
        eyes = smooth_rise((t_s - one.start_s) / _SACCADE_S)[:, None]
        p_m = p_m + eyes * (target - p_m)
    aside = moving_average(yaw - body_yaw, _EASED_ROWS)
    return LookAngles(body_yaw + aside, moving_average(pitch, _EASED_ROWS), p_m, _wander(t_s, rng))


def _turn_to_target(
    target: Floats, fully: bool, eyes_m: Floats, body_yaw: Floats
) -> tuple[Floats, Floats]:
    way = target - eyes_m
    aside = wrap_angle(yaw_of(way) - body_yaw)
    # People do not turn to a target behind them, nor to a target that they pass closely.
    near = np.hypot(way[:, 0], way[:, 1])
    share = (1.0 if fully else _OTHERS_SHARE) * smooth_rise((near - 0.25) / 0.6)
    share = share * (1.0 - smooth_rise((np.abs(aside) - 1.9) / 1.0))
    aside = np.clip(share * aside, -HEAD_YAW_RAD, HEAD_YAW_RAD)
    up = np.clip(share * pitch_of(way), -HEAD_DOWN_RAD, HEAD_UP_RAD)
    return body_yaw + aside, up


def _wander(t_s: Floats, rng: np.random.Generator) -> Floats:
    """Return small jumps (n, 2) of the gaze around its target; none at the end of a round."""
    out, at_s = np.zeros((len(t_s), 2)), float(rng.uniform(0.4, 1.5))
    while at_s < t_s[-1] - 0.6:
        new = rng.normal(0.0, _WANDER_RAD, 2).clip(-2.0 * _WANDER_RAD, 2.0 * _WANDER_RAD)
        out += smooth_rise((t_s - at_s) / 0.03)[:, None] * (new - out)
        at_s += float(rng.uniform(0.35, 1.8))
    return np.asarray(out * (1.0 - smooth_rise((t_s - t_s[-1] + 0.3) / 0.03))[:, None])


def eyes_in_head(R_head: Floats, eyes_m: Floats, look: LookAngles) -> tuple[Floats, Floats]:
    """Return yaw and pitch of the eyes in the head."""
    way = ((look.p_m - eyes_m)[:, None, :] @ R_head)[:, 0]
    way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    way = limit_angle(way, np.broadcast_to((1.0, 0.0, 0.0), way.shape), EYE_RAD - 0.1)
    return yaw_of(way) + look.wander[:, 0], pitch_of(way) + 0.7 * look.wander[:, 1]


def head_gestures(t_s: Floats, acts: Sequence[TimedAct], round_s: float) -> tuple[Floats, Floats]:
    """Return yaw and pitch that nods, shakes, speech and life add to a head."""
    yaw = radians(0.5) * periodic(t_s, round_s, (0.31, 0.83), (0.4, 2.0))
    pitch = radians(0.5) * periodic(t_s, round_s, (0.27, 0.71), (1.4, 0.3))
    for one in acts:
        lasts_s = one.end_s - one.start_s
        share = (t_s - one.start_s) / max(lasts_s, 1e-3)
        gone_s = t_s - one.start_s
        swell = smooth_bump(share)
        if one.act.do == "nod":
            pitch = pitch - radians(11.0) * swell**0.5 * np.sin(2 * np.pi * 1.7 * gone_s)
        elif one.act.do == "shake":
            yaw = yaw + radians(14.0) * swell**0.5 * np.sin(2 * np.pi * 1.6 * gone_s)
        elif one.act.do == "speak":
            held = there_and_back(t_s, one.start_s, 0.3, max(lasts_s - 0.6, 0.0), 0.3)
            pitch = pitch + radians(1.6) * held * np.sin(2 * np.pi * 0.9 * gone_s)
            yaw = yaw + radians(1.4) * held * np.sin(2 * np.pi * 0.6 * gone_s + 1.0)
    return np.asarray(yaw), np.asarray(pitch)


def lip_opening(t_s: Floats, acts: Sequence[TimedAct], rng: np.random.Generator) -> Floats:
    """Return the opening of the mouth (n,), 0..1: syllables of several loudnesses, and pauses."""
    out = np.zeros_like(t_s)
    for one in acts:
        if one.act.do != "speak":
            continue
        at_s, left = one.start_s + 0.05, int(rng.integers(5, 12))
        while at_s < one.end_s - 0.25:
            lasts_s = float(rng.uniform(0.8, 1.25)) / _SYLLABLES_HZ
            loud = float(rng.uniform(0.35, 1.0))
            out = np.maximum(out, loud * smooth_bump((t_s - at_s) / (1.1 * lasts_s)))
            at_s, left = at_s + lasts_s, left - 1
            if left == 0:
                at_s, left = at_s + float(rng.uniform(0.2, 0.5)), int(rng.integers(5, 12))
    return out


def lid_closure(t_s: Floats, rng: np.random.Generator) -> Floats:
    """Return the closure of the lids by blinks (n,), 0..1."""
    out, at_s = np.zeros_like(t_s), float(rng.uniform(0.5, 3.0))
    while at_s < t_s[-1] - 0.5:
        out = np.maximum(out, there_and_back(t_s, at_s, 0.08, 0.03, 0.17))
        at_s += _BLINK_LEAST_S + float(rng.exponential(_BLINK_MEAN_S))
    return out
