"""Several heads in one world, each controlled by its own robot that sees only its own picture.

The end of one head ends all: each parks and releases its servos.
"""

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from gazerig.features.world.run.run_world import world_of, world_scene
from gazerig.features.world.run.shared_world import (
    RealTimeWorld,
    SharedWorld,
    SimulatedWorld,
)
from gazerig.features.world.world_scene import HeadsScene, RigFrame
from gazerig.robot.analysis.mutual_gaze import HeadPlacement, MutualGazeTrace
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_rig import run_rig
from gazerig.robot.app.session import SECONDS, ComposedRun, compose, run
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.loop_timing import BUSY_SHARE
from gazerig.robot.control.robot_group import NamedRobot
from gazerig.robot.control.tick import Tick

_SHORTEST_S = 3.0
"""A shorter run gives no statistics."""
_ENOUGH = 0.7
"""With a smaller share of the pictures a head reacts visibly later."""


def overload_message(
    runs: Iterable[tuple[str, Mapping[str, Any] | None]], pictures_hz: float, rendered: bool
) -> str:
    """Return a line with the heads that could not keep up in real time, "" if all did."""
    slow = []
    for name, figures in runs:
        if figures is None or figures["seconds"] < _SHORTEST_S:
            continue
        late = figures["overruns"] / max(1, figures["ticks"] + figures["overruns"])
        seen_hz = figures["pictures"] / figures["seconds"]
        if late >= BUSY_SHARE or seen_hz < _ENOUGH * pictures_hz:
            slow.append(
                f"{name}: {late:.0%} of ticks late, {seen_hz:.0f} of {pictures_hz:.0f} pictures "
                "a second"
            )
    if not slow:
        return ""
    less = "; --no-pictures reduces the load" if rendered else ""
    return f"the computer is too busy for these heads ({'; '.join(slow)}){less}"


FIRST = "first"


class _Member(NamedTuple):
    """One head of a group."""

    name: str
    composed: ComposedRun
    frame: RigFrame


def has_other_heads(options: RunOptions) -> bool:
    """Return whether the requested world has other heads.

    Raises:
        gazerig.config.load.ConfigError: its file has a fault, or does not exist.
        SetupError: they cannot be run with these options.
    """
    if options.world is None:
        return False
    return bool(world_scene(options.world, options.seed).figures.script.heads)


def compose_group(options: RunOptions) -> "HeadGroup":
    """Assemble a run of several heads; nothing moves.

    Raises:
        gazerig.config.load.ConfigError: the world or one of the rigs has a fault.
        SetupError: they cannot be run with these options.
    """
    first = run_rig(options)
    found = world_of(first, options)
    assert found.spec.figures is not None  # heads are part of a script
    heads = found.spec.figures.script.heads
    others = [
        replace(
            options,
            rig=heads[name].rig or options.rig,
            seed=options.seed + n,
            record=None if options.record is None else other_head_file(options.record, name),
            heatmap=None,
            summary=None,
            page=None,
        )
        for n, name in enumerate(heads, 1)
    ]
    each = (options, *others)
    rigs = [(FIRST, first), *zip(heads, map(run_rig, others), strict=True)]
    world = SimulatedWorld(found) if options.fast else RealTimeWorld(found, rigs)
    members: list[_Member] = []
    try:
        faces = [world.face(number, rig) for number, (_, rig) in enumerate(rigs)]
        for number, ((name, rig), one) in enumerate(zip(rigs, each, strict=True)):
            frame = world.frames[number]
            faced = [face for n, face in enumerate(faces) if n != number]
            room = world.room(
                number, rig, one, partial(HeadsScene, frame=frame, faces=faced, first=number == 0)
            )
            members.append(_Member(name, compose(one, room=room), frame))
    except BaseException:
        for member in members:
            member.composed.assembly.close()
        world.close()
        raise
    pictures = None if options.fast else (found.camera.rate_hz, not options.no_pictures)
    # The other heads are attached to the first, so that its commands can stop all.
    leader, *rest = members
    robots = tuple(NamedRobot(one.name, one.composed.assembly.robot) for one in rest)
    made = leader.composed.assembly._replace(other_heads=robots)
    # The process has one parameter store and one remote control: those of the first head.
    alone = [one._replace(composed=one.composed._replace(tuning=None)) for one in rest]
    linked = [leader._replace(composed=leader.composed._replace(assembly=made)), *alone]
    return HeadGroup(linked, world, pictures)


def other_head_file(path: Path, name: str) -> Path:
    """Return the path of the file of another head: run.mcap, run-other.mcap."""
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


class LinkedInterrupts(Interrupts):
    """Requests to end a head that ends with another head: its own, and those of the other."""

    def __init__(self, lead: Interrupts) -> None:
        super().__init__(also=lead, signals=False)
        self._lead = lead

    @property
    def requests(self) -> int:
        """Return the number of requests to end; the second one skips parking."""
        return max(super().requests, self._lead.requests)


class HeadGroup:
    """Several heads that run together until one of them ends.

    Args:
        members: the heads, the first one first.
        world: the world of the heads.
        pictures: in real time the rate of each camera in pictures a second, and whether they are
            rendered; None: time is simulated and waits for them.
    """

    def __init__(
        self,
        members: Sequence[_Member],
        world: SharedWorld,
        pictures: tuple[float, bool] | None = None,
    ) -> None:
        self.members, self._world = tuple(members), world
        self._pictures = pictures
        self._figures: list[dict[str, object] | None] = [None] * len(members)
        self._failures: list[BaseException] = []
        self._ending: set[int] = set()
        self._print_lock = threading.Lock()
        places = [HeadPlacement(member.frame.R, member.frame.p_m) for member in members]
        self._traces = [MutualGazeTrace(places[0], other) for other in places[1:]]

    def run(
        self,
        stopped: Callable[[], str | None],
        say: Callable[[str], None],
        status: Callable[[str], None] | None = None,
        watch: Callable[[Tick], object] | None = None,
        browse: Callable[[str], object] | None = None,
    ) -> dict[str, object]:
        """Run until one head ends; return the figures of the first and of the others.

        Args: see ``gazerig.robot.app.session.run``; status, watch and browse belong to the first.

        Raises:
            SetupError: before any motion.
        """
        lead = stopped if isinstance(stopped, Interrupts) else Interrupts(also=stopped)
        following = [LinkedInterrupts(lead) for _ in self.members[1:]]
        threads = [
            threading.Thread(target=self._follow, args=(number, lead, one, say), name=member.name)
            for number, (member, one) in enumerate(zip(self.members[1:], following, strict=True), 1)
        ]

        def end_all(reason: str) -> None:
            for number, one in enumerate(following, 1):
                # A second request would skip the parking of a head that is already ending.
                if one.requests == 0 and number not in self._ending:
                    one.request(f"the end of the first head{reason and f' ({reason})'}")

        def ended(reason: str) -> None:
            if reason != SECONDS:  # all heads reach that end by themselves
                end_all(reason)

        def watch_first(tick: Tick) -> None:
            for trace in self._traces:
                trace.update(0, tick)
            if watch is not None:
                watch(tick)

        for thread in threads:
            thread.start()
        try:
            self._world.enter(0)
            self._figures[0] = run(
                self.members[0].composed, lead, self._printer(say), status,
                watch_first, browse, ended,
            )  # fmt: skip
        # An end was requested before the start, possibly by a failed head
        except KeyboardInterrupt:
            if not self._failures:
                raise
        finally:
            lead.only_record()  # the other heads have yet to park
            end_all("")
            self._world.leave(0)
            for thread in threads:
                thread.join()
            self._world.close()
        if self._failures:
            raise self._failures[0]
        names = [member.name for member in self.members]
        if self._pictures is not None and (
            line := overload_message(zip(names, self._figures, strict=True), *self._pictures)
        ):
            say(line)
        first, *others = self._figures
        assert first is not None
        gazes = dict(zip(names[1:], (trace.figures() for trace in self._traces), strict=True))
        return {**first, "mutual_gaze": gazes, "heads": dict(zip(names[1:], others, strict=True))}

    def _follow(
        self, number: int, lead: Interrupts, own: Interrupts, say: Callable[[str], None]
    ) -> None:
        """Run another head in its thread."""
        name = self.members[number].name

        def ended(reason: str) -> None:
            self._ending.add(number)
            if own.requests == 0 and reason != SECONDS:
                lead.request(f"the end of head {name} ({reason})")

        try:
            self._world.enter(number)
            self._figures[number] = run(
                self.members[number].composed, own, self._printer(say, f"{name}: "),
                watch=lambda tick: self._traces[number - 1].update(1, tick), ends=ended,
            )  # fmt: skip
        except KeyboardInterrupt:  # an end was requested before the start
            lead.request(f"the end of head {name} before it began")
        except BaseException as error:
            self._failures.append(error)
            lead.request(f"the end of head {name} ({type(error).__name__})")
        finally:
            self._world.leave(number)

    def _printer(self, say: Callable[[str], None], before: str = "") -> Callable[[str], None]:
        """Return a function that prints whole lines, from the thread of any head."""

        def one_by_one(line: str) -> None:
            with self._print_lock:
                say(before + line)

        return one_by_one
