"""A script's acts with their true start and end times, and the gaze events that they cause.

Acts that move one limb follow each other in the script; others may overlap.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import NamedTuple, Protocol

import numpy as np

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event
from gazerig.sim_mock.scenes.script import HEAD, Act, Fault, SceneScript

TRACKS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("walk", "step", "turn", "sit", "stand"), ("legs",)),
    **dict.fromkeys(("open_guard", "gesture"), ("left arm", "right arm")),
    **dict.fromkeys(("look_at", "speak", "nod", "shake", "glance", "guard"), ()),
}
"""Limbs that each act moves; an act that is not listed moves the arm on its side."""
LASTS_S: Mapping[str, float] = {
    "step": 0.9,
    "turn": 1.2,
    "sit": 1.7,
    "stand": 1.7,
    "look_at": 0.0,
    "speak": 3.0,
    "nod": 1.2,
    "shake": 1.2,
    "wave": 2.6,
    "gesture": 3.0,
    "point": 2.2,
    "reach": 2.8,
    "push": 2.0,
    "pass": 2.4,
    "punch": 0.6,
    "feint": 0.3,
    "open_guard": 1.4,
    "glance": 0.6,
    "spin": 3.0,
}
"""Default durations of acts; the duration of a walk follows from its path."""
NEEDS_TARGET = ("walk", "turn", "look_at", "point", "reach", "push", "pass", "punch")
WALKS_TO_PLACES = ("walk", "step")
HALF_FIELD_RAD = 34.5 / 180.0 * np.pi
"""Half of the camera's horizontal field: a hand farther to the side cannot be detected."""
_RETURN_S = 1.3
_QUIET_S = 0.5


class TimedAct(NamedTuple):
    """An act with its start and end; ``target``: a fixed point, None for a person."""

    act: Act
    start_s: float
    end_s: float
    target: Vec3 | None = None

    @property
    def tracks(self) -> tuple[str, ...]:
        """Return the limbs that the act moves."""
        return TRACKS.get(self.act.do, (f"{self.act.side} arm",))


Timelines = Mapping[str, tuple[TimedAct, ...]]


def timed_acts(
    script: SceneScript,
    name: str,
    seed: int,
    lasts_s: Callable[[Act, str], float],
    target: Callable[[Act], Vec3 | None],
) -> tuple[TimedAct, ...]:
    """Return the acts of a person, in the script's order, with random times from the seed."""
    person = script.people[name]
    rng = np.random.default_rng([seed, list(script.people).index(name)])
    at, found = person.start, []
    for act in person.acts:
        start_s = max(0.0, act.at_s + act.vary_s * float(rng.uniform(-1.0, 1.0)))
        found.append(TimedAct(act, start_s, start_s + lasts_s(act, at), target(act)))
        if act.do in WALKS_TO_PLACES and act.to:
            at = act.to
    return tuple(found)


def name_faults(
    script: SceneScript, places: Collection[str], robot: tuple[str, ...] = (HEAD,)
) -> Iterator[Fault]:
    """Find names that do not exist, and reports of the agent that would never come."""
    named: list[tuple[str, str, Collection[str]]] = []
    targets = {*robot, *script.people, *places}
    for name, person in script.people.items():
        key = f"people.{name}"
        named += [(f"{key}.start", person.start, places)]
        named += [(f"{key}.looks_at", person.looks_at, targets)]
        for i, act in enumerate(person.acts):
            own = f"{key}.acts.{i}"
            if act.to or act.do in NEEDS_TARGET:
                known = places if act.do in WALKS_TO_PLACES else targets
                named += [(f"{own}.to", act.to, script.people if act.do == "pass" else known)]
            if act.do == "pass":
                named += [(f"{own}.thing", act.thing, script.things)]
            named += [(f"{own}.via", place, places) for place in act.via]
    before_s = 0.0
    for i, report in enumerate(script.agent):
        if not before_s <= report.at_s < script.round_s:
            yield f"agent.{i}.at_s", "reports are in the order of time, within the round"
        before_s = report.at_s
        named += [(f"agent.{i}.person", report.person, ("", *script.people))]
    for i, look in enumerate(script.expected or ()):
        named += [(f"expected.{i}.at", look.at, places)]
    for key, name, known in named:
        if name not in known:
            yield key, f"the script has no {name!r} here; it has {', '.join(sorted(known))}"


class Players(Protocol):
    """Positions of the people and things of a script."""

    def face(self, name: str, t_s: float) -> Vec3:
        """Return the tip of a nose."""
        ...

    def hand(self, name: str, side: str, t_s: float) -> Vec3:
        """Return the middle of a hand."""
        ...

    def place(self, name: str) -> Vec3:
        """Return a place, at the height of what is looked at there."""
        ...

    def reach_times_s(self, one: TimedAct) -> tuple[float, float]:
        """Return the times that a hand needs to its target, and back."""
        ...

    def is_before_head(self, p_m: Vec3) -> bool:
        """Return whether a point is in the field of view of a camera that points ahead."""
        ...


def events_of(script: SceneScript, timelines: Timelines, players: Players) -> tuple[Event, ...]:
    """Return the events of a round and the response of a person's gaze.

    They are those that the script lists, or those that its acts suggest.
    """
    if script.expected is not None:
        return tuple(
            Event(one.name, "look", one.kind, one.start_s, one.end_s, players.place(one.at), one.within_m)
            for one in script.expected
        )  # fmt: skip
    boxers = [name for name, person in script.people.items() if person.gloves]
    found: list[Event] = []
    for name, acts in timelines.items():
        for one in acts:
            found += _events_of_act(script, players, name, one, name in boxers)
    for name in boxers:
        # A boxer's face is looked at during longer times without other events.
        quiet, free_s = [], 0.0
        busy = sorted((event.start_s, event.end_s) for event in found)
        for start_s, end_s in (*busy, (script.round_s, script.round_s)):
            if start_s - free_s >= _QUIET_S:
                face = players.face(name, 0.5 * (free_s + start_s))
                quiet.append(Event("face", "look", "face", free_s, start_s, face, 0.6))
            free_s = max(free_s, end_s)
        found += quiet
    return tuple(sorted(found, key=lambda event: event.start_s))


def _events_of_act(
    script: SceneScript, players: Players, name: str, one: TimedAct, boxes: bool
) -> Iterator[Event]:
    """Yield the event of an act that is visible to the robot."""
    do, side, start_s, end_s = one.act.do, one.act.side, one.start_s, one.end_s
    middle_s = 0.5 * (start_s + end_s)
    if do == "reach":
        # A look is expected while the hand is in view of a camera that points ahead.
        times = np.arange(start_s, end_s, 0.001).tolist()
        inside = [t_s for t_s in times if players.is_before_head(players.hand(name, side, t_s))]
        if inside:
            hand = players.hand(name, side, middle_s)
            yield Event(do, "look", "hand", inside[0], inside[-1], hand, 0.25)
    elif do == "wave":
        yield Event(do, "look", "hand", start_s, end_s, players.hand(name, side, middle_s), 0.5)
    elif do == "punch":
        due_s = start_s + players.reach_times_s(one)[0]
        ends = (players.hand(name, side, t_s) for t_s in (start_s, due_s))
        x, y, z = (0.5 * (a + b) for a, b in zip(*ends, strict=True))
        yield Event(do, "look", "hand", start_s, end_s, (x, y, z), 0.5, due_s)
    elif do == "speak" or (boxes and do == "step"):
        within_m = 0.5 if do == "speak" else 0.6
        yield Event(do, "look", "face", start_s, end_s, players.face(name, middle_s), within_m)
    elif boxes and do == "feint":
        until_s = min(start_s + _RETURN_S, script.round_s)
        face = players.face(name, middle_s)
        yield Event("return", "return", "face", start_s, until_s, face, 0.6)
    elif boxes and do == "open_guard":
        out_s, back_s = (0.5 * one_s for one_s in players.reach_times_s(one))
        face = players.face(name, middle_s)
        target = "attack_target"
        yield Event("attack", "look", target, start_s + out_s, end_s - back_s, face, 0.6)
