"""Bottom-up attention: the salience of each visible body by its motion.

Mitake et al. eq 1 sums three stimuli to which cells of the areas MT and MST respond:
translation across the line of view (slide), motion along it (loom) and rotation about it (spin). It
has two forms, and can be switched off:

literal   As printed: one gaze direction e for all bodies, no distance, metres and radians
          added without conversion. Printed with e/|e| on a projection that is only right for
          |e| = 1, so e is normalised.
retinal   By the paper's reason, the image on the retina: e from the eye to each body,
          speeds relative to the moving eye and divided by the distance, each term
          in units of the motion that counts as 1.
none      No motion attracts: rules alone select targets.

A body that has just entered the view has a further, decaying term: the paper's behaviour (e), a
hand that reaches in from outside the field, is not in eq 1. If motion saturates, a body that begins
to move has it too: it captures attention like a new one (Abrams & Christ 2003). Onsets that follow
each other weigh less, as people stop looking at repeated appearances (Neo & Chua 2006). While the
head turns fast, the view moves: what comes into it is not new, and motion is not seen, as in
people's gaze shifts.

In the retinal form the sum saturates for the comparison: no motion alone outweighs a face for long.
An approach that would arrive within two seconds is exempt, such as a hand that reaches for the
head.

Bodies are computed one by one in plain arithmetic: for the few that a frame shows, that costs less
than calls of NumPy.
"""

from collections.abc import Collection
from dataclasses import dataclass
from math import exp, expm1, inf, radians
from typing import Annotated, Literal

from gazerig.gaze.angles import dot, norm, perpendicular, sub, unit
from gazerig.gaze.types import BodyRows, Salience, Vec3
from gazerig.params import Bounds

_BLINK_S = 0.3
"""A body unseen for at most this time was missed by the detector and did not leave."""

_TURNS_RAD_S, _TURNED_S = radians(40.0), 0.3
"""Speed of the head at which it turns fast, and time after it in which pictures still show that."""
_MOVES, _STILL_BELOW = 0.5, 0.15
"""Sums of eq 1 above which a body moves, and below which it rests."""
_SETTLED_S = 0.5
"""Time after entry during which a body gets no onset of motion as well."""
_NEAREST_M = 0.05

_ROTATION_RAD_S = 3.0
"""Angular speed about the line of sight that gives salience 1."""
_MOST, _MOST_OF_HAND = 0.35, 0.9
"""Salience that motion alone cannot exceed, and that of a hand raised to the face."""
OWN_MOTION = 0.3
"""Share of their motion that a person's own hands and clothes keep, unless they are raised to the
face or reach out; the rest is added to the face.
"""
_SMOOTHING_S = 0.1
"""Time constant of the low-pass filter of salience."""
_ONSET_S, _RECOVERY_S = 0.5, 2.0
"""Time constants with which an onset decays, and with which the next regains its full salience."""
_LEAST = 0.05
"""A thing less salient than this is not a target; it gets only glances, like anything in view."""


@dataclass(frozen=True)
class BottomUpParams:
    """Form and reference motions of eq 1, and the salience of a new body."""

    # fmt: off
    form: Annotated[Literal["retinal", "literal", "none"],
        "retinal: motion as angles seen by the eye; literal: eq 1 as printed, without weights, limit, filter and onset; none: "
        "neither motion nor onset attracts the gaze"] = "retinal"
    reference: Annotated[float, Bounds(0.01, 20),
        "motion that gives salience 1: rad/s across the line of sight, and the part of the distance per second along it"] = 0.5
    onset_salience: Annotated[float, Bounds(0, 10), "extra salience of a body that has just entered or begun to move; 0: none"] = 1.0
    # fmt: on


def motion_terms(v: Vec3, w: Vec3, e: Vec3) -> Vec3:
    """Return the three terms of eq 1 for one body: slide, loom and spin.

    Loom is signed: positive for an approach.

    Args:
        v: velocity, m/s.
        w: angular velocity, rad/s.
        e: view direction of any length, normalised here.
    """
    e = unit(e)
    return norm(perpendicular(v, e)), -dot(v, e), abs(dot(w, e))


_FAST, _FASTEST = 1.0, 3.0
"""Range of looming that is exempt from saturation."""


def saturate(slide: float, loom: float, spin: float, most: float, worth: float) -> float:
    """Return the sum of the terms of eq 1, saturated: worth most (1 - exp(-sum / most)).

    Args:
        slide: translation across the line of view.
        loom: motion along it, positive for an approach.
        spin: rotation about it.
        most: limit of the sum; inf: no limit.
        worth: share of the sum that counts.
    """
    if most == inf:
        return worth * (slide + abs(loom) + spin)
    exempt = min(max(loom, _FAST), _FASTEST) - _FAST
    total = slide + abs(loom) - max(loom - _FAST, 0.0) + spin
    return worth * (exempt - expm1(-total / most) * most)


@dataclass(slots=True)
class _BodyState:
    """State of one body.

    entered_s, seen_s: time of entry into view and of the last sight
    onset: share of the onset's salience at entry
    moves: whether it moves
    slide, loom, spin: smoothed terms of eq 1, loom with its sign
    """

    entered_s: float
    onset: float
    moves: bool
    seen_s: float
    slide: float = 0.0
    loom: float = 0.0
    spin: float = 0.0


class BottomUp:
    """Eq 1 with a low-pass filter per body, and the salience of new bodies."""

    def __init__(self, params: BottomUpParams) -> None:
        self._params = params
        self.reset(0.0)

    def retune(self, params: BottomUpParams) -> None:
        """Change the parameters; the state of the bodies stays."""
        self._params = params

    @property
    def least_salience(self) -> float:
        """Return the least salience of a thing that is a target."""
        return 0.0 if self._params.form == "literal" else _LEAST

    def reset(self, t_s: float) -> None:
        """Forget all bodies."""
        self._states: dict[int, _BodyState] = {}
        self._at_s = t_s
        self._onset_s = -inf
        self._started_s = inf
        self._turned_s = -inf

    def step(
        self,
        rows: BodyRows,
        p_world_eye_m: Vec3,
        t_s: float,
        v_world_eye_m_s: Vec3,
        gaze_world: Vec3,
        seen: Collection[int],
        raised: Collection[int] = (),
        own: Collection[int] = (),
        head_rad_s: float = 0.0,
        settles: bool = False,
    ) -> list[Salience]:
        """Return the smoothed salience of all bodies, in their order; 0 for those not in view.

        It must also be called without bodies; otherwise the next body does not count as new.

        Args:
            rows: the bodies.
            p_world_eye_m: position of the eye.
            t_s: time of the frame.
            v_world_eye_m_s: velocity of the eye itself; the literal form ignores it.
            gaze_world: gaze direction, any length; only the literal form needs it.
            seen: ids of the bodies in view.
            raised: ids of raised hands.
            own: ids of people's own hands and clothes, of whose motion only a share counts.
            head_rad_s: speed at which the head turns; only the retinal form needs it.
            settles: whether somebody has just come: only faces have an onset.
        """
        par, states = self._params, self._states
        if par.form == "none":
            return [Salience(*body) for body in zip(rows.ids, rows.kinds, strict=True)]
        self._shift_times(t_s)
        fresh = -expm1((self._onset_s - t_s) / _RECOVERY_S)
        new, gain, most = 0.0, 1.0, inf
        turns = False
        if par.form == "retinal":
            new, gain = par.onset_salience, 1.0 - exp(min(0.0, self._at_s - t_s) / _SMOOTHING_S)
            if turns := head_rad_s > _TURNS_RAD_S:
                self._turned_s = t_s
            if t_s - self._turned_s < _TURNED_S:
                gain = 0.0
        found = []
        for i, id in enumerate(rows.ids):
            state = states.get(id)
            if id not in seen:
                if state is not None:
                    state.slide = state.loom = state.spin = 0.0
                found.append(Salience(id, rows.kinds[i]))
                continue
            slide, loom, spin = self._motion(rows, i, p_world_eye_m, v_world_eye_m_s, gaze_world)
            if state is None or t_s - state.seen_s > _BLINK_S:
                moves = slide + abs(loom) + spin > _MOVES
                # A body seen in the first moments was there before: it entered long ago.
                was_there = turns or t_s - self._started_s <= _BLINK_S
                entered_s = -inf if was_there else t_s
                state = states[id] = _BodyState(entered_s, fresh, moves, t_s)
                self._onset_s = max(self._onset_s, state.entered_s)
            state.seen_s = t_s
            state.slide = slide = state.slide + gain * (slide - state.slide)
            state.loom = loom = state.loom + gain * (loom - state.loom)
            state.spin = spin = state.spin + gain * (spin - state.spin)
            moved = slide + abs(loom) + spin
            if par.form == "retinal":
                most = _MOST_OF_HAND if id in raised and rows.kinds[i] == "hand" else _MOST
            if (
                most < inf
                and moved > _MOVES
                and not state.moves
                and t_s - max(state.entered_s, self._started_s) > _SETTLED_S
            ):
                state.entered_s = self._onset_s = t_s
                state.onset = fresh
            if settles and rows.kinds[i] != "face":
                state.onset = 0.0
            state.moves = moved > (_STILL_BELOW if state.moves else _MOVES)
            onset = state.onset * new * exp((state.entered_s - t_s) / _ONSET_S)
            worth = OWN_MOTION if id in own else 1.0
            total = saturate(slide, loom, spin, most, worth) + onset
            found.append(Salience(id, rows.kinds[i], slide, abs(loom), spin, onset, total=total))
        self._at_s = t_s
        self._states = {id: one for id, one in states.items() if t_s - one.seen_s <= _BLINK_S}
        return found

    def _motion(self, rows: BodyRows, i: int, p_eye: Vec3, v_eye: Vec3, gaze: Vec3) -> Vec3:
        """Return the present slide, loom and spin of one body, by the form."""
        par, v, w = self._params, rows.v_world_m_s[i], rows.w_world_rad_s[i]
        if par.form == "literal":
            return motion_terms(v, w, gaze)
        rel = sub(rows.p_world_m[i], p_eye)
        slide, loom, spin = motion_terms(sub(v, v_eye), w, rel)
        distance = max(norm(rel), _NEAREST_M)
        return (
            slide / (distance * par.reference),
            loom / (distance * par.reference),
            spin / _ROTATION_RAD_S,
        )

    def _shift_times(self, t_s: float) -> None:
        """Shift all times after a long pause without steps, so that no body counts as gone."""
        paused_s = t_s - self._at_s
        if self._started_s < inf and paused_s <= _BLINK_S:
            return
        self._started_s = t_s
        if paused_s > 0.0:
            for state in self._states.values():
                state.seen_s += paused_s
