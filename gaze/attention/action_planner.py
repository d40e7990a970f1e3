"""Action planner of a boxing match: guard, attack or wait (Mitake et al. 3.2, 3.3.3).

The paper takes the three behaviours from the action planner of an earlier boxing game, which it
does not describe and which has access to both bodies. This planner uses only percepts, one after
the other.

guard   A fist approaches the head directly and arrives soon. The gaze follows it until it stops.
attack  The opponent is within reach, no fist approaches, and a place is open: no hand is near the
        line to it; for a moment after a punch less room suffices. The gaze is on the place before
        the blow.
wait    Anything else.

No place is open while the position of a hand is unknown. A hand that left the picture while it
moved away from the face is taken to be lowered.
"""

from dataclasses import dataclass
from math import inf
from typing import Annotated, Literal, NamedTuple

from gazerig.gaze.attention.opponent import (
    HANDS,
    Approach,
    HitTarget,
    OpponentHands,
    approaches,
    hit_places,
    nearest_face,
)
from gazerig.gaze.types import Face, Percept, Vec3, body_name
from gazerig.params import Bounds

Action = Literal["wait", "guard", "attack"]
ACTIONS: tuple[Action, ...] = ("wait", "guard", "attack")

_STILL: Vec3 = (0.0, 0.0, 0.0)
_SURE_SD = 2.0
"""A speed is certain if it exceeds its limit by this number of standard deviations."""
_LONGEST_GAP_S = 0.5
"""Duration without a frame after which every action ends."""


@dataclass(frozen=True)
class ActionPlannerParams:
    """Conditions of guard and attack in a boxing match."""

    # fmt: off
    enabled: Annotated[bool, "select the behaviours wait, guard and attack from the percept"] = False
    contact_ms: Annotated[float, Bounds(0, 5000), "guard against a fist that arrives within this time; 0: never"] = 450.0
    contact_m: Annotated[float, Bounds(0, 2), "a fist closer to the head than this has arrived"] = 0.3
    closing_m_s: Annotated[float, Bounds(0, 20), "a fist that approaches more slowly than this is not a punch"] = 0.8
    miss_m: Annotated[float, Bounds(0, 5),
        "a fist that would pass the middle of the eyes farther away than this is not a punch: half a head and half a fist"] = 0.2
    reaction_ms: Annotated[float, Bounds(0, 1000),
        "a possible punch must have approached for this long, unless its speed is certain"] = 30.0
    release_ratio: Annotated[float, Bounds(1, 10),
        "guard ends when the fist fails contact_ms, closing_m_s and miss_m by more than this factor"] = 1.5
    min_guard_ms: Annotated[float, Bounds(0, 10000), "shortest time on guard"] = 300.0
    attack_reach_m: Annotated[float, Bounds(0, 10), "an opponent whose face is farther away is not attacked; 0: nobody is attacked"] = 1.3
    open_m: Annotated[float, Bounds(0, 2), "a place is open if every hand is at least this far from the line to it"] = 0.28
    opening_ms: Annotated[float, Bounds(0, 5000), "a place must have been open for this long"] = 200.0
    counter_ms: Annotated[float, Bounds(0, 5000), "for this time after a guard counter_ratio applies and opening_ms does not"] = 300.0
    counter_ratio: Annotated[float, Bounds(0, 1), "share of open_m that is sufficient during that time"] = 0.6
    attack_ms: Annotated[float, Bounds(50, 10000), "duration of the look at the place before the blow has landed"] = 600.0
    rest_ms: Annotated[float, Bounds(0, 60000), "shortest time between the end of an attack and the next"] = 800.0
    hand_memory_ms: Annotated[float, Bounds(0, 60000),
        "an unseen hand is remembered for this long: where it was, or lowered if it moved away from the face"] = 600.0
    counts_every_motion: Annotated[bool,
        "with the planner, hands that repeat their motion or move down keep their salience, as fists must be watched; "
        "false: as rhythm_ratio and sinking_ratio define"] = True
    # fmt: on


class Plan(NamedTuple):
    """Action and reason.

    body_id: the approaching fist, on guard; -1 otherwise
    p_world_m, v_world_m_s: the place to hit, in an attack; None otherwise
    """

    action: Action
    why: str
    body_id: int = -1
    p_world_m: Vec3 | None = None
    v_world_m_s: Vec3 = _STILL

    @property
    def text(self) -> str:
        """Return action and reason."""
        return f"{self.action}: {self.why}"


WAITING = Plan("wait", "no one is in view")


class ActionPlanner:
    """Action planner, stepped once for each new percept."""

    def __init__(self, params: ActionPlannerParams) -> None:
        self._params = params
        self._hands = OpponentHands()
        self.reset()

    def retune(self, params: ActionPlannerParams) -> None:
        """Change the parameters; the present action continues with the new ones."""
        self._params = params

    def reset(self) -> None:
        """Forget the opponent and the present action."""
        self._hands.reset()
        self.plan = WAITING
        self._since_s = self._at_s = self._guard_end_s = self._attack_end_s = -inf
        self._comes: tuple[int, float] | None = None
        self._open: tuple[str, float] | None = None
        self._place = ""

    def step(self, percept: Percept, p_eye: Vec3, t_s: float, asked: Action | None = None) -> Plan:
        """Return the next action.

        Args:
            percept: the new percept.
            p_eye: middle of the robot's eyes.
            t_s: present time, seconds; the percept is older.
            asked: the action that the user has chosen; None: the planner decides.
        """
        if t_s - self._at_s > _LONGEST_GAP_S:
            self.reset()
        self._at_s = t_s
        par = self._params
        threat = self._threat(percept, p_eye, t_s)
        face = nearest_face(percept.faces, p_eye, par.attack_reach_m)
        found = []
        if face is not None:
            memory_s = par.hand_memory_ms / 1e3
            hands = self._hands.step(percept.bodies, face, memory_s, t_s)
            found = (
                hit_places(face, hands, p_eye) if len(hands) >= HANDS or asked is not None else []
            )
        if asked is not None:
            self.plan = self._user_plan(asked, percept, face, found, p_eye)
            self._since_s = t_s
        elif threat is not None:
            self.plan = self._guard(threat, t_s)
        elif self.plan.action == "guard" and t_s - self._since_s < par.min_guard_ms / 1e3:
            pass  # the action continues
        else:
            if self.plan.action == "guard":
                self._guard_end_s = t_s
            self.plan = self._attack(face, found, t_s)
        return self.plan

    def _user_plan(
        self,
        asked: Action,
        percept: Percept,
        face: Face | None,
        found: list[HitTarget],
        p_eye: Vec3,
    ) -> Plan:
        """Return the user's action, for the place with most room or the nearest fist."""
        why = "asked for"
        if asked == "attack" and face is not None:
            return Plan(asked, why, -1, found[0].p_world_m, face.v_world_m_s)
        if asked == "guard" and (fists := approaches(percept.bodies, p_eye, 0.0, 0.0)):
            return Plan(asked, why, min(fists, key=lambda one: one.away_m).id)
        return Plan(asked, why)

    def _threat(self, percept: Percept, p_eye: Vec3, t_s: float) -> Approach | None:
        """Return the first fist to arrive of those that have approached for the reaction time."""
        par, guarded = self._params, self.plan.body_id
        late_s = max(0.0, t_s - percept.captured_s)
        coming = [
            one
            for one in approaches(percept.bodies, p_eye, par.contact_m, late_s)
            if self._is_punch(one, par.release_ratio if one.id == guarded else 1.0)
        ]
        if not coming:
            self._comes = None
            return None
        first = min(coming, key=lambda one: (one.contact_s, one.id))
        if self._comes is None or self._comes[0] != first.id:
            self._comes = first.id, percept.captured_s
        ready = percept.captured_s - self._comes[1] >= par.reaction_ms / 1e3 - 1e-9
        sure = first.closing_m_s - _SURE_SD * first.closing_sd_m_s >= par.closing_m_s
        return first if sure or ready or self.plan.action == "guard" else None

    def _is_punch(self, one: Approach, ratio: float) -> bool:
        """Return whether a fist moves like a punch; ratio: tolerance."""
        par = self._params
        return (
            one.contact_s < ratio * par.contact_ms / 1e3
            and one.closing_m_s * ratio >= par.closing_m_s
            and one.miss_m <= ratio * par.miss_m
        )

    def _guard(self, threat: Approach, t_s: float) -> Plan:
        if self.plan.action != "guard":
            self._since_s = t_s
        self._open = None
        why = f"{body_name(threat.kind, threat.id)} arrives in {threat.contact_s:.2f} s"
        return Plan("guard", why, threat.id)

    def _attack(self, face: Face | None, found: list[HitTarget], t_s: float) -> Plan:
        """Begin an attack, continue it, or wait."""
        par, now = self._params, self.plan
        if now.action == "attack":
            if t_s - self._since_s < par.attack_ms / 1e3:
                there = [place for place in found if place.name == self._place]
                if face is None or not there:  # missed for a frame
                    return now
                return now._replace(p_world_m=there[0].p_world_m, v_world_m_s=face.v_world_m_s)
            self._attack_end_s = t_s
        if face is None:
            self._open = None
            return Plan("wait", "no opponent within reach")
        if not found:
            self._open = None
            return Plan("wait", "not both hands of the opponent are known")
        best, counters = found[0], t_s - self._guard_end_s < par.counter_ms / 1e3
        if best.clear_m < par.open_m * (par.counter_ratio if counters else 1.0):
            self._open = None
            return Plan(
                "wait",
                f"no fist approaches, and the opponent's guard is closed ({best.clear_m:.2f} m)",
            )
        if self._open is None or self._open[0] != best.name:
            self._open = best.name, t_s
        if not counters and t_s - self._open[1] < par.opening_ms / 1e3 - 1e-9:
            return Plan("wait", f"no fist approaches; {best.name} opens")
        if t_s - self._attack_end_s < par.rest_ms / 1e3:
            return Plan("wait", f"{best.name} is open, but the last attack has just ended")
        self._since_s, self._place = t_s, best.name
        after = " after a punch" if counters else ""
        why = f"{best.name} is open{after} ({best.clear_m:.2f} m from any hand)"
        return Plan("attack", why, -1, best.p_world_m, face.v_world_m_s)
