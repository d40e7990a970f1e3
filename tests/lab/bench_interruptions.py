"""Time from an interruption to the face, whatever the head does at that moment.

``python tests/lab/bench_interruptions.py [EACH]`` interrupts the desk rig EACH times per phase,
scene and seed, by partners whom the camera shows, and prints the times.
docs/measurements/conversation.md has the results.
"""

import sys
from collections import defaultdict
from collections.abc import Callable
from itertools import product
from math import degrees

import numpy as np

from gazerig.config.schema import load_rig
from gazerig.features.lab.report.gaze_trace import GazeTraceBuilder
from gazerig.features.lab.report.turns import AVERTED_DEG, CLEAR_DEG
from gazerig.gaze.types import Floats
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, TickLoop
from gazerig.robot.model.commands import Command, Play, Talk

SEEDS = (1, 2, 3)
SCENES = ("face-to-face", "three-people")
_TURNING_DEG_S = 10.0
_HOLDS_S = 0.1
_LONGEST_S = 25.0
_LATER_S = 0.2


def averts(tick: Tick) -> bool:
    """Return whether the gaze is averted from the partner."""
    return tick.target.kind == "away" and tick.target.id == tick.conversation.partner


def turns_to(tick: Tick) -> bool:
    """Return whether the head turns."""
    return abs(degrees(tick.pose.head_rate_rad_s[0])) > _TURNING_DEG_S


PHASES: dict[str, Callable[[Tick], bool]] = {
    "on the face": lambda tick: (
        tick.target.kind == "face" and tick.target.id == tick.conversation.partner
    ),
    "averted": lambda tick: averts(tick) and tick.gaze.phase == "fixate",
    "head turn": turns_to,
    "blink": lambda tick: averts(tick) and tick.gaze.blink,
    "track": lambda tick: averts(tick) and any(one.is_playing for one in tick.tracks),
    "eyes leave": lambda tick: averts(tick) and tick.gaze.phase == "saccade",
    "other person": lambda tick: (
        tick.target.kind == "face" and tick.target.id != tick.conversation.partner
    ),
}
"""What the head does as it is interrupted."""


def sees_partner(tick: Tick) -> bool:
    """Return whether the camera shows the partner."""
    faces = tick.percept.faces if tick.percept is not None else ()
    return any(face.id == tick.conversation.partner for face in faces)


def interrupt_often(seed: int, scene: str, each: int) -> dict[str, list[float]]:
    """Return the times to the partner's face by phase, in seconds."""
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=seed, scene=scene))
    made.robot.start(made.clock)
    rng = np.random.default_rng(seed)
    builder, last, begins = GazeTraceBuilder(), list[Tick](), list[tuple[str, float]]()

    def watch(tick: Tick) -> None:
        builder.update(tick)
        last[:] = [tick]

    loop = TickLoop(made.robot, made.clock, made.loop, lambda s: None, watch)

    def go(seconds: float) -> Tick:
        end_s = made.clock.now_s() + seconds
        while made.clock.now_s() < end_s:
            assert loop.step() is None
        return last[0]

    def do(*commands: Command) -> None:
        for command in commands:
            made.robot.command(command)

    try:
        go(8.0)
        for phase in [*PHASES] * each:
            percept = last[0].percept
            people = sorted(face.id for face in percept.faces) if percept is not None else []
            partner = people[len(begins) % len(people)] if people else None
            do(Talk("speaking", partner, seconds=60.0, stay=True))
            go(2.0)
            if phase == "head turn" and len(people) > 1:
                other = people[(len(begins) + 1) % len(people)]
                do(Talk("speaking", other, seconds=60.0, stay=True))
            latest_s = made.clock.now_s() + _LONGEST_S
            holds = PHASES[phase]
            while made.clock.now_s() < latest_s:
                if holds(go(0.004)) and holds(go(rng.uniform(0.0, _LATER_S))):
                    break  # at any moment of the phase, not always at its begin
                if phase == "track" and not any(one.is_playing for one in last[0].tracks):
                    do(Play("shake"))
            if sees_partner(last[0]) and made.clock.now_s() < latest_s:
                begins.append((phase, last[0].t_s))
                do(Talk("interrupt", stay=True))
                go(1.5)
            do(Talk("idle", stay=True))
            go(0.5)
    finally:
        made.robot.stop()
        made.close()
    run, found = builder.trace().turns(), defaultdict[str, list[float]](list)
    limit = np.maximum(AVERTED_DEG, run.edge_deg + CLEAR_DEG)
    on_face = np.hypot(*run.off_deg.T) <= limit
    for phase, begin_s in begins:
        found[phase].append(_first_hold_s(run.t_s, on_face, begin_s))
    return found


def _first_hold_s(t_s: Floats, holds: np.ndarray, begin_s: float) -> float:
    """Return the time from a begin until a condition holds for a while."""
    first = int(np.searchsorted(t_s, begin_s, "right"))
    for row in range(first, len(t_s)):
        end = int(np.searchsorted(t_s, t_s[row] + _HOLDS_S))
        if holds[row:end].all():
            return float(t_s[row] - t_s[first])
    return float("inf")


def main() -> None:
    """Measure all phases."""
    each = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    every, total = defaultdict[str, list[float]](list), list[float]()
    for seed, scene in product(SEEDS, SCENES):
        for phase, times in interrupt_often(seed, scene, each).items():
            every[phase] += times
            total += times
    for phase, times in [*every.items(), ("all", total)]:
        middle, late = np.percentile(times, (50.0, 95.0))
        print(
            f"{phase:12} n {len(times):3d}  median {1e3 * middle:4.0f}  95 % below "
            f"{1e3 * late:4.0f}  max {1e3 * max(times):4.0f} ms"
        )


if __name__ == "__main__":
    main()
