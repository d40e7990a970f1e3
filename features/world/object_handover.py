"""Things passed from hand to hand: the holder and the pose of each over time."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from gazerig.features.world.rotations import quaternions, rotate_vectors, yaw_of, yaw_pitch_roll
from gazerig.features.world.time_profiles import smooth_rise
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.script import Act, Fault, SceneScript
from gazerig.sim_mock.scenes.timeline import TimedAct, Timelines

GRIP_M = np.array((0.046, 0.0, -0.085))
"""Middle of a held thing, in the hand's frame."""
_CHANGES_S = 0.3
Side = Literal["left", "right"]
_OTHER: Mapping[Side, Side] = {"left": "right", "right": "left"}


class Holder(NamedTuple):
    """Hand that holds a thing from ``from_s`` on."""

    from_s: float
    person: str
    side: str


def holders(script: SceneScript, timelines: Timelines, thing: str) -> list[Holder]:
    """Return the successive holders of a thing; it changes hands in the middle of a pass."""
    first = script.things[thing]
    return [
        Holder(0.0, first.held_by, first.side),
        *(
            Holder(0.5 * (one.start_s + one.end_s), one.act.to, _OTHER[one.act.side])
            for one, _, _ in _passes(timelines, thing)
        ),
    ]


def _passes(timelines: Timelines, thing: str) -> list[tuple[TimedAct, str, int]]:
    """Return the passes of a thing in the order of time, with the giver and the act's number."""
    found = [
        (one, name, i)
        for name, acts in timelines.items()
        for i, one in enumerate(acts)
        if one.act.do == "pass" and one.act.thing == thing
    ]
    return sorted(found, key=lambda found: found[0].start_s)


def receiving_acts(timelines: Timelines, name: str) -> list[TimedAct]:
    """Return the acts of a person that take things from others, with the hand on the same side."""
    return [
        TimedAct(
            Act(one.act.at_s, "pass", giver, side=_OTHER[one.act.side]), one.start_s, one.end_s
        )
        for giver, acts in timelines.items()
        for one in acts
        if one.act.do == "pass" and one.act.to == name
    ]


def holding_share(t_s: Floats, found: Sequence[Holder], person: str, side: str) -> Floats:
    """Return the weight of the holding posture of a hand (n,): 0 free, 1 holding."""
    total = np.zeros_like(t_s)
    for i, one in enumerate(found):
        now = 1.0 if (one.person, one.side) == (person, side) else 0.0
        since = np.ones_like(t_s) if i == 0 else smooth_rise((t_s - one.from_s + 0.6) / 1.2)
        total = total + since * (now - total)
    return total


def thing_poses(
    t_s: Floats,
    found: Sequence[Holder],
    hands: Mapping[tuple[str, str], tuple[Floats, Floats]],
    ahead: Mapping[str, Floats],
) -> Floats:
    """Return positions and quaternions (n, 7) of a thing, which stays upright.

    Args:
        t_s: times of the rows.
        found: holders of the thing.
        hands: positions (n, 3) and rotations (n, 3, 3) of hands by person and side.
        ahead: (n, 3) direction in which each person faces.
    """
    place, yaw = np.zeros((len(t_s), 3)), np.zeros_like(t_s)
    for i, one in enumerate(found):
        p_m, R = hands[one.person, one.side]
        since = np.ones_like(t_s) if i == 0 else smooth_rise((t_s - one.from_s) / _CHANGES_S + 0.5)
        place = place + since[:, None] * (p_m + rotate_vectors(R, GRIP_M) - place)
        turn = np.unwrap(yaw_of(ahead[one.person]))
        yaw = turn if i == 0 else yaw + since * (turn - yaw)
    return np.concatenate((place, quaternions(yaw_pitch_roll(yaw, 0.0 * yaw))), axis=1)


def handover_faults(script: SceneScript, timelines: Timelines) -> Iterator[Fault]:
    """Yield passes by a person who does not hold the thing, and things that end in another hand."""
    for thing, first in script.things.items():
        holder, side = first.held_by, first.side
        for one, name, i in _passes(timelines, thing):
            key, act = f"people.{name}.acts.{i}", one.act
            if name != holder:
                yield f"{key}.thing", f"{holder} holds {thing} then; let {holder} pass it"
            elif act.side != side:
                yield f"{key}.side", f"{name} has {thing} in the {side} hand; write side: {side}"
            holder, side = act.to, _OTHER[act.side]
        if (holder, side) != (first.held_by, first.side):
            yield (
                f"things.{thing}.held_by",
                f"is in {holder}'s {side} hand when the round ends, in {first.held_by}'s "
                f"{first.side} when it begins; let it be passed back",
            )
