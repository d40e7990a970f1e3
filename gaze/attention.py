"""The winner of bottom-up and top-down attention (Mitake et al. 3.3.4), and the reason why.

The larger amount of attention wins. Two nearly equal amounts would flicker, so the
present winner is kept unless another is clearly stronger, and for a shortest time.
"""

from dataclasses import dataclass, field

from gaze.bottom_up import BottomUp, Pulls
from gaze.field_of_view import FieldOfView
from gaze.idle import Idle
from gaze.top_down import TopDown, Wanted
from gaze.types import Bodies, Floats, GazeState, Percept, Target, Vec3


@dataclass(frozen=True)
class AttentionParams:
    """Hysteresis, and how old a picture may be."""

    stay_factor: float = field(
        default=1.2,
        metadata={
            "low": 1.0,
            "high": 10.0,
            "unit": "",
            "says": "another body must pull this many times stronger to take over",
        },
    )
    shortest_ms: float = field(
        default=300.0,
        metadata={
            "low": 0.0,
            "high": 10000.0,
            "unit": "ms",
            "says": "shortest time with one body",
        },
    )
    stale_ms: float = field(
        default=400.0,
        metadata={
            "low": 20.0,
            "high": 10000.0,
            "unit": "ms",
            "says": "a picture older than this no longer tells what is there",
        },
    )


class Attention:
    """Chooses the target, once for each new picture."""

    def __init__(
        self,
        params: AttentionParams,
        field_of_view: FieldOfView,
        bottom_up: BottomUp,
        top_down: TopDown,
        idle: Idle,
    ) -> None:
        """Take the models it decides between."""
        self._params = params
        self._field_of_view = field_of_view
        self._bottom_up = bottom_up
        self.top_down = top_down
        self._idle = idle
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget everything seen."""
        for model in (self._bottom_up, self.top_down, self._idle):
            model.reset(t_s)
        self._seen_s = float("-inf")
        self._target: Target | None = None
        self._shift = 0
        self._since_s = float("-inf")
        self._identity: tuple[str, int] | None = None

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Give the target in force at ``t_s``."""
        fresh = percept is not None and percept.age_s(t_s) <= self._params.stale_ms / 1e3
        if percept is not None and fresh and percept.captured_s != self._seen_s:
            self._seen_s = percept.captured_s
            self._target = self._decide(percept, state, t_s)
            if self._target is not None:
                self._idle.remember(self._target)
        if self._target is not None and fresh:
            return self._settle(self._target, t_s)
        return self._settle(self._idle.step(t_s), t_s)

    def _settle(self, target: Target, t_s: float) -> Target:
        """Count a shift whenever another thing is looked at."""
        identity = (target.kind, target.id)
        if identity != self._identity:
            self._identity = identity
            self._shift += 1
            self._since_s = t_s
        return target._replace(shift=self._shift)

    def _decide(self, percept: Percept, state: GazeState, t_s: float) -> Target | None:
        """Compare all visible bodies with the rule's choice."""
        seen = _only(percept, self._field_of_view.visible(percept.bodies, state).tolist())
        bodies = seen.bodies
        if len(bodies) == 0:
            return None
        pulls = self._bottom_up.step(bodies, state.p_world_head_m, t_s)
        wanted = self.top_down.step(seen, state.p_world_head_m)
        row = self._winner(bodies, pulls.total, wanted, t_s)
        return _target(bodies, row, pulls, wanted, seen.captured_s)

    def _winner(self, bodies: Bodies, total: Floats, wanted: Wanted | None, t_s: float) -> int:
        """Give the row of the strongest body, the present one being favoured."""
        strength = total.tolist()
        if wanted is not None:
            strength[wanted.row] = max(strength[wanted.row], wanted.pull)
        best = max(range(len(strength)), key=strength.__getitem__)
        present = self._identity[1] if self._identity is not None else -1
        if present in bodies.ids:
            row = bodies.ids.index(present)
            young = t_s - self._since_s < self._params.shortest_ms / 1e3
            if young or strength[best] < strength[row] * self._params.stay_factor:
                return row
        return best


def _only(percept: Percept, mask: list[bool]) -> Percept:
    """Keep the bodies in the mask."""
    if all(mask):
        return percept
    b = percept.bodies
    rows = [row for row, keep in enumerate(mask) if keep]
    kept = Bodies(
        tuple(b.ids[row] for row in rows),
        tuple(b.kinds[row] for row in rows),
        b.p_world_m[rows],
        b.v_world_m_s[rows],
        b.w_world_rad_s[rows],
        b.radius_m[rows],
    )
    return Percept(percept.captured_s, kept, percept.faces)


def _target(
    bodies: Bodies, row: int, pulls: Pulls, wanted: Wanted | None, captured_s: float
) -> Target:
    """Make the target of a row, with the reason in words."""
    slide, loom, spin = (float(term[row]) for term in pulls)
    pull = slide + loom + spin
    by_rule = wanted is not None and wanted.row == row and wanted.pull >= pull
    name = f"{bodies.kinds[row]} {bodies.ids[row]}"
    if wanted is not None and by_rule:
        why = f"{name}: rule {wanted.behaviour} {wanted.pull:.2f} over motion {pull:.2f}"
        pull = wanted.pull
    else:
        why = f"{name}: slide {slide:.2f} + loom {loom:.2f} + spin {spin:.2f}"
    return Target(
        _vec(bodies.p_world_m[row]),
        _vec(bodies.v_world_m_s[row]),
        captured_s,
        bodies.kinds[row],
        bodies.ids[row],
        pull,
        by_rule,
        None,
        0,
        why,
    )


def _vec(row: Floats) -> Vec3:
    x, y, z = row.tolist()
    return (x, y, z)
