"""Bottom-up attention: the salience of each visible body by its motion.

Mitake et al. eq 1 sums three stimuli to which cells of the areas MT and MST respond:
translation across the line of view (slide), motion along it (loom) and rotation about it (spin). It
has two forms, and can be switched off:

literal   As printed: one gaze direction e for all bodies, no distance, metres and radians
          added as they are. Printed with e/|e| on a projection that is only right for
          |e| = 1, so e is normalised.
retinal   As the paper's reason, the image on the retina, demands: e from the eye to each
          body, speeds relative to the moving eye and divided by the distance, each term
          in units of the motion that counts as 1.
none      No motion attracts: rules alone select targets.

A body that has just entered the view has a further, decaying term: the paper's behaviour (e), a
hand that reaches in from outside the field, is not in eq 1. If motion saturates, a body that begins
to move has it too: it captures attention like a new one (Abrams & Christ 2003). Onsets that follow
each other weigh less, as people stop looking at repeated appearances (Neo & Chua 2006).

In the retinal form the sum saturates for the comparison: no motion alone outweighs a face for long.
An approach that would arrive within two seconds is exempt, such as a hand that reaches for the
head.

All bodies are computed together, and the state of each is a row of an array. The usual few are
computed one by one in plain arithmetic, as a handful of numbers costs less than one call of NumPy.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, expm1, inf, sqrt
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.field_of_view import BLOCK, columns
from gazerig.gaze.types import Bodies, BodyRows, Floats, Vec3
from gazerig.params import Bounds

Ids = NDArray[np.int64]

_BLINK_S = 0.3
"""A body unseen for at most this time was missed by the detector and did not leave."""

_MOVES, _STILL_BELOW = 0.5, 0.15
"""Sums of eq 1 above which a body moves, and below which it rests."""
_SETTLED_S = 0.5
"""Time after entry during which a body gets no onset of motion as well."""
_NEAREST_M = 0.05
_STILL: Vec3 = (0.0, 0.0, 0.0)
_AHEAD: Vec3 = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class BottomUpParams:
    """Form and reference motions of eq 1, and the salience of a new body."""

    # fmt: off
    form: Annotated[Literal["retinal", "literal", "none"],
        "retinal: motion as angles seen by the eye; literal: eq 1 as printed, without weights; none: neither motion nor onset "
        "attracts"] = "retinal"
    translation_reference_rad_s: Annotated[float, Bounds(0.01, 20), "angular speed across the line of sight that gives salience 1"] = 0.5
    looming_reference_1_s: Annotated[float, Bounds(0.01, 20),
        "speed along the line of sight divided by distance that gives salience 1"] = 0.5
    rotation_reference_rad_s: Annotated[float, Bounds(0.01, 100), "angular speed about the line of sight that gives salience 1"] = 3.0
    saturation: Annotated[float, Bounds(0, 10),
        "salience that motion alone cannot exceed, unless it comes nearer fast; 0: no limit"] = 0.35
    hand_saturation: Annotated[float, Bounds(0, 10), "the same of a hand raised to the face, as one that waves; 0: no limit"] = 0.9
    smoothing_s: Annotated[float, Bounds(0, 2), "time constant of the low-pass filter of salience"] = 0.1
    onset_salience: Annotated[float, Bounds(0, 10), "extra salience of a body that has just come into view or begun to move; 0: none"] = 1.0
    onset_s: Annotated[float, Bounds(0.02, 10), "time constant with which onset_salience decays"] = 0.5
    onset_recovery_s: Annotated[float, Bounds(0, 60),
        "time constant with which the next onset regains its full salience; 0: every onset has it"] = 2.0
    # fmt: on


class MotionTerms(NamedTuple):
    """Terms of eq 1 for each body: (n,) arrays; looming is negative for a receding body."""

    translation: Floats
    looming: Floats
    rotation: Floats


class SalienceRow(NamedTuple):
    """Amount of attention of one body, term by term; total: the compared amount."""

    translation: float
    looming: float
    rotation: float
    onset: float
    total: float


class SalienceTerms(NamedTuple):
    """Amount of attention of each body, term by term: (n,) arrays; total: the compared amount."""

    translation: Floats
    looming: Floats
    rotation: Floats
    onset: Floats
    total: Floats

    def row(self, index: int) -> SalienceRow:
        """Return the terms of one body."""
        return SalienceRow(*[float(term[index]) for term in self])


def motion_terms(v: Floats, w: Floats, e: Floats) -> MotionTerms:
    """Return the three terms of eq 1 for all bodies at once.

    v, w: (n, 3) velocities (m/s) and angular velocities (rad/s)
    e:    (n, 3) or (3,) view directions of any length
    Source: Mitake et al., eq 1, with e normalised.
    """
    e = columns(e if e.ndim == 2 else e[None, :])
    terms = _eq_1(columns(v), columns(w), e / np.maximum(_length(e), 1e-300))
    return terms._replace(looming=np.abs(terms.looming))


def _eq_1(v: Floats, w: Floats, e: Floats) -> MotionTerms:
    """Return the terms of (3, n) vectors, e being of length 1; looming with its sign."""
    along = (v * e).sum(axis=0)
    return MotionTerms(_length(v - along * e), -along, np.abs((w * e).sum(axis=0)))


_FAST, _FASTEST = 1.0, 3.0
"""Range of looming that is exempt from saturation."""


def limited(terms: Floats, most: Floats, worth: Floats) -> Floats:
    """Return the sum of the terms of eq 1, saturated: worth most (1 - exp(-sum / most)).

    Args:
        terms: (3, n) slide, loom and spin; loom is positive for an approach.
        most: (n,) limit of motion; inf: no limit.
        worth: (n,) the share that counts.
    """
    slide, loom, spin = terms
    free = np.isinf(most)
    exempt = np.where(free, 0.0, np.clip(loom, _FAST, _FASTEST) - _FAST)
    rest = np.abs(loom) - np.where(free, 0.0, np.maximum(loom - _FAST, 0.0))
    total, bound = slide + rest + spin, np.where(free, 1.0, most)
    out: Floats = worth * (exempt + np.where(free, total, -np.expm1(-total / bound) * bound))
    return out


def limited_row(slide: float, loom: float, spin: float, most: float, worth: float) -> float:
    """Return the result of ``limited`` for one body."""
    if most == inf:
        return worth * (slide + abs(loom) + spin)
    exempt = min(max(loom, _FAST), _FASTEST) - _FAST
    total = slide + abs(loom) - max(loom - _FAST, 0.0) + spin
    return worth * (exempt - expm1(-total / most) * most)


def _length(v: Floats) -> Floats:
    """Return the lengths of the columns of a (3, n) array."""
    out: Floats = np.sqrt((v * v).sum(axis=0))
    return out


_UNSEEN = SalienceRow(0.0, 0.0, 0.0, 0.0, 0.0)


class _Memory(NamedTuple):
    """State of m bodies, in any order: (m,) arrays, terms (3, m).

    terms: smoothed slide, loom (with its sign) and spin; entered_s, seen_s: time of entry into view
        and of the last sight; onset: share of the onset's salience at entry; moving: whether it
        moves, 0 or 1
    """

    ids: Ids
    terms: Floats
    entered_s: Floats
    seen_s: Floats
    onset: Floats
    moving: Floats

    def rows(self) -> "_Rows":
        """Return the same, body by body."""
        terms, *others = (one.tolist() for one in (self.terms.T, *self[2:]))
        return _Rows(self.ids, terms, *others)

    def only(self, mask: NDArray[np.bool_]) -> "_Memory":
        """Return the memory of the bodies in the mask."""
        return _Memory(self.ids[mask], self.terms[:, mask], *[one[mask] for one in self[2:]])


class _Rows(NamedTuple):
    """State of few bodies, one entry a body; fields as in ``_Memory``."""

    ids: Ids
    terms: list[list[float]]
    entered_s: list[float]
    seen_s: list[float]
    onset: list[float]
    moving: list[float]

    def arrays(self) -> _Memory:
        """Return the same as arrays."""
        terms = np.array(self.terms).reshape(-1, 3).T
        return _Memory(self.ids, terms, *[np.array(one) for one in self[2:]])


def _never_seen(ids: Ids) -> _Memory:
    """Return the state of bodies that were never seen."""
    n = len(ids)
    never, none = np.full(n, -np.inf), np.zeros(n)
    return _Memory(ids, np.zeros((3, n)), never, never.copy(), none, none.copy())


class BottomUp:
    """Eq 1 with a low-pass filter per body, and the salience of new bodies."""

    def __init__(self, params: BottomUpParams) -> None:
        self._params = params
        self.reset(0.0)

    def retune(self, params: BottomUpParams) -> None:
        """Change the reference motions; the state of the bodies stays."""
        self._params = params

    @property
    def needs_gaze(self) -> bool:
        """Return whether the present form depends on the gaze direction."""
        return self._params.form == "literal"

    def reset(self, t_s: float) -> None:
        """Forget all bodies."""
        self._ids: tuple[int, ...] = ()
        self._gone = _never_seen(np.zeros(0, dtype=np.int64))
        self._memory: _Memory | _Rows = self._gone
        self._at_s = t_s
        self._onset_s = -inf
        self._started_s = inf

    def step(
        self,
        bodies: Bodies,
        p_world_eye_m: Vec3,
        t_s: float,
        v_world_eye_m_s: Vec3 = _STILL,
        gaze_world: Vec3 = _AHEAD,
        seen: NDArray[np.bool_] | None = None,
        most: Sequence[float] | None = None,
        worth: Sequence[float] | None = None,
    ) -> SalienceTerms:
        """Return the smoothed salience of all bodies, in their order; 0 for those not in view.

        It must be called without bodies, too, or the next body does not count as new.

        v_world_eye_m_s: velocity of the eye itself; the literal form ignores it
        gaze_world: gaze direction, any length; only the literal form needs it
        seen: (n,) which bodies are in view; None: all
        most: limit of each body's motion; None: ``saturation``
        worth: of each body, the share of its motion that counts; None: all
        """
        if self._params.form == "none":
            return SalienceTerms(*np.zeros((5, len(bodies))))
        if seen is None:
            seen = np.ones(len(bodies), dtype=np.bool_)
        now = self._terms(bodies, p_world_eye_m, v_world_eye_m_s, gaze_world)
        self._pause(t_s)
        if bodies.ids != self._ids:
            self._remember(bodies.ids, t_s)
        limits = np.full(len(bodies), self.limit()) if most is None else np.array(most)
        shares = np.ones(len(bodies)) if worth is None else np.array(worth)
        return self._blend(now, seen, t_s, limits, shares)

    def limit(self, hand: bool = False) -> float:
        """Return the limit of motion; inf: no limit, as in the paper's own form."""
        par = self._params
        most = par.hand_saturation if hand else par.saturation
        return most if most > 0.0 and par.form == "retinal" else inf

    def step_rows(
        self,
        rows: BodyRows,
        p_world_eye_m: Vec3,
        t_s: float,
        v_world_eye_m_s: Vec3,
        gaze_world: Vec3,
        seen: list[bool],
        most: Sequence[float],
        worth: Sequence[float],
    ) -> list[SalienceRow]:
        """Return the result of ``step`` for few bodies, one row per body."""
        if self._params.form == "none":
            return [_UNSEEN] * len(rows.ids)
        self._pause(t_s)
        if rows.ids != self._ids:
            self._remember(rows.ids, t_s)
        par, memory = self._params, self._memory
        if isinstance(memory, _Memory):
            memory = self._memory = memory.rows()
        _, past, entered_s, seen_s, strength, moving = memory  # changed in place
        fresh = self._onset_share(t_s)
        keep = exp(min(0.0, self._at_s - t_s) / par.smoothing_s) if par.smoothing_s > 0.0 else 0.0
        found = []
        for i, in_view in enumerate(seen):
            if not in_view:
                past[i] = [0.0, 0.0, 0.0]
                found.append(_UNSEEN)
                continue
            now = self._row(rows, i, p_world_eye_m, v_world_eye_m_s, gaze_world)
            if t_s - seen_s[i] > _BLINK_S:
                past[i], entered_s[i], strength[i] = [0.0, 0.0, 0.0], self._entry_s(t_s), fresh
                moving[i] = float(now[0] + abs(now[1]) + now[2] > _MOVES)
                self._onset_s = max(self._onset_s, entered_s[i])
            seen_s[i] = t_s
            slide, loom, spin = past[i]
            slide += (1.0 - keep) * (now[0] - slide)
            loom += (1.0 - keep) * (now[1] - loom)
            spin += (1.0 - keep) * (now[2] - spin)
            past[i] = [slide, loom, spin]
            moved = slide + abs(loom) + spin
            if (
                most[i] < inf
                and moved > _MOVES
                and not moving[i]
                and t_s - max(entered_s[i], self._started_s) > _SETTLED_S
            ):
                entered_s[i] = self._onset_s = t_s
                strength[i] = fresh
            moving[i] = float(moved > (_STILL_BELOW if moving[i] else _MOVES))
            onset = strength[i] * par.onset_salience * exp((entered_s[i] - t_s) / par.onset_s)
            total = limited_row(slide, loom, spin, most[i], worth[i]) + onset
            found.append(SalienceRow(slide, abs(loom), spin, onset, total))
        self._at_s = t_s
        return found

    def _row(
        self, rows: BodyRows, i: int, p_eye: Vec3, v_eye: Vec3, gaze: Vec3
    ) -> tuple[float, float, float]:
        """Return the present slide, loom and spin of one body; scalar form of ``_terms``."""
        par = self._params
        (vx, vy, vz), (wx, wy, wz) = rows.v_world_m_s[i], rows.w_world_rad_s[i]
        if par.form == "literal":
            x, y, z = gaze
        else:
            px, py, pz = rows.p_world_m[i]
            x, y, z = px - p_eye[0], py - p_eye[1], pz - p_eye[2]
            vx, vy, vz = vx - v_eye[0], vy - v_eye[1], vz - v_eye[2]
        length = sqrt(x * x + y * y + z * z)
        over = max(length, 1e-300)
        x, y, z = x / over, y / over, z / over
        along = vx * x + vy * y + vz * z
        ax, ay, az = vx - along * x, vy - along * y, vz - along * z
        across, spin = sqrt(ax * ax + ay * ay + az * az), abs(wx * x + wy * y + wz * z)
        if par.form == "literal":
            return across, -along, spin
        distance = max(length, _NEAREST_M)
        return (
            across / (distance * par.translation_reference_rad_s),
            -along / (distance * par.looming_reference_1_s),
            spin / par.rotation_reference_rad_s,
        )

    def _terms(self, bodies: Bodies, p_eye: Vec3, v_eye: Vec3, gaze: Vec3) -> Floats:
        """Return the present slide, loom and spin, (3, n)."""
        now = np.empty((3, len(bodies)))
        for start in range(0, len(bodies), BLOCK):
            some = slice(start, start + BLOCK)
            v, w = bodies.v_world_m_s[some], bodies.w_world_rad_s[some]
            if self._params.form == "literal":
                e = np.asarray(gaze)[:, None]
                now[:, some] = _eq_1(columns(v), columns(w), e / max(_length(e)[0], 1e-300))
            else:
                rel, v, w = columns(bodies.p_world_m[some]), columns(v), columns(w)
                rel -= np.array(p_eye)[:, None]
                v -= np.array(v_eye)[:, None]
                self._retinal(rel, v, w, now[:, some])
        return now

    def _retinal(self, rel: Floats, v: Floats, w: Floats, out: Floats) -> None:
        """Write the (3, n) terms of bodies at ``rel`` from the eye, moving past it with ``v``."""
        par = self._params
        length = _length(rel)
        raw = _eq_1(v, w, rel / np.maximum(length, 1e-300))
        distance = np.maximum(length, _NEAREST_M)
        out[0] = raw.translation / (distance * par.translation_reference_rad_s)
        out[1] = raw.looming / (distance * par.looming_reference_1_s)
        out[2] = raw.rotation / par.rotation_reference_rad_s

    def _onset_share(self, t_s: float) -> float:
        """Return the share of the full salience of an onset at this time."""
        recovery_s = self._params.onset_recovery_s
        return -expm1((self._onset_s - t_s) / recovery_s) if recovery_s > 0.0 else 1.0

    def _blend(
        self,
        now: Floats,
        seen: NDArray[np.bool_],
        t_s: float,
        most: Floats,
        worth: Floats,
    ) -> SalienceTerms:
        """Return the low-passed terms and the onset term; a new body starts at 0."""
        tau, old = self._params.smoothing_s, self._arrays()
        keep = exp(min(0.0, self._at_s - t_s) / tau) if tau > 0.0 else 0.0
        past, (entered_s, seen_s, strength, moves) = old.terms, (one.copy() for one in old[2:])
        fresh = self._onset_share(t_s)
        new = seen & (t_s - seen_s > _BLINK_S)
        if new.any():
            past, entry_s = past.copy(), self._entry_s(t_s)
            past[:, new], entered_s[new], strength[new] = 0.0, entry_s, fresh
            moves[new] = now[0, new] + np.abs(now[1, new]) + now[2, new] > _MOVES
            self._onset_s = max(self._onset_s, entry_s)
        smooth = now  # becomes past + (1 - keep) (now - past), without new arrays
        smooth -= past
        smooth *= 1.0 - keep
        smooth += past
        moved = smooth[0] + np.abs(smooth[1]) + smooth[2]
        settled = t_s - np.maximum(entered_s, self._started_s) > _SETTLED_S
        begins = (moved > _MOVES) & (moves == 0.0) & settled
        begins &= seen & np.isfinite(most)
        if begins.any():
            entered_s[begins], strength[begins], self._onset_s = t_s, fresh, t_s
        moving = (moved > np.where(moves, _STILL_BELOW, _MOVES)).astype(np.float64)
        onset = np.exp((entered_s - t_s) / self._params.onset_s)
        onset *= self._params.onset_salience * strength
        if not seen.all():
            smooth *= seen
            onset *= seen
        np.copyto(seen_s, t_s, where=seen)
        self._memory = _Memory(old.ids, smooth, entered_s, seen_s, strength, moving)
        self._at_s = t_s
        total = limited(smooth, most, worth) + onset
        return SalienceTerms(smooth[0], np.abs(smooth[1]), smooth[2], onset, total)

    def _arrays(self) -> _Memory:
        """Return the memory as arrays."""
        return self._memory if isinstance(self._memory, _Memory) else self._memory.arrays()

    def _pause(self, t_s: float) -> None:
        """Shift all times after a long pause without steps, so that no body counts as gone."""
        paused_s = t_s - self._at_s
        if self._started_s < inf and paused_s <= _BLINK_S:
            return
        self._started_s = t_s
        if paused_s > 0.0:
            memory = self._arrays()
            self._memory = memory._replace(seen_s=memory.seen_s + paused_s)
            self._gone = self._gone._replace(seen_s=self._gone.seen_s + paused_s)

    def _entry_s(self, t_s: float) -> float:
        """Return the time of entry of a body first seen at ``t_s``.

        A body seen in the first moments was there before: it entered long ago.
        """
        return t_s if t_s - self._started_s > _BLINK_S else -np.inf

    def _remember(self, ids: tuple[int, ...], t_s: float) -> None:
        """Rearrange the memory for other bodies; those missed for a moment stay."""
        now = _never_seen(np.fromiter(ids, dtype=np.int64, count=len(ids)))
        old = _joined(self._arrays(), self._gone)
        old = old.only(t_s - old.seen_s <= _BLINK_S)
        order = np.argsort(old.ids, kind="stable")
        at = np.searchsorted(old.ids, now.ids, sorter=order)
        known = at < len(order)
        known[known] = old.ids[order[at[known]]] == now.ids[known]
        rows = order[at[known]]
        now.terms[:, known] = old.terms[:, rows]
        for mine, its in zip(now[2:], old[2:], strict=True):
            mine[known] = its[rows]
        away = np.ones(len(order), dtype=np.bool_)
        away[rows] = False
        self._ids, self._memory, self._gone = ids, now, old.only(away)


def _joined(a: _Memory, b: _Memory) -> _Memory:
    """Return two memories of different bodies as one."""
    return _Memory(*[np.concatenate((x, y), axis=-1) for x, y in zip(a, b, strict=True)])
