"""Several heads in one world, each led by a robot of its own that sees only its own picture.

In simulated time all of them run in this process, each in a thread, on one clock and in one world
(gazerig.robot.app.lockstep): the same seed gives the same bytes on every bus.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.gaze.angles import add, rotate
from gazerig.robot.analysis.mutual_gaze import HeadPlace, MutualGazeTrace
from gazerig.robot.app.assemble import SharedPlace
from gazerig.robot.app.gaze_models import kinematics_of
from gazerig.robot.app.lockstep import Lockstep
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_world import RunWorld, world_of, world_scene
from gazerig.robot.app.session import ComposedRun, compose, run
from gazerig.robot.app.world_poses import RigInState, SimulatedPoses
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.head_shape import HeadMeasures
from gazerig.sim_mock.world.heads_scene import HeadFace, HeadsScene, RigFrame

if TYPE_CHECKING:
    from gazerig.sim_mock.world.physics import World

FIRST = "first"


class _Member(NamedTuple):
    """One head of a group.

    Attributes:
        name: in the script; the first one's is ``FIRST``.
        composed: its robot, put together.
        frame: where it stands.
    """

    name: str
    composed: ComposedRun
    frame: RigFrame


def has_other_heads(options: RunOptions) -> bool:
    """Return whether other heads are in the world that was asked for.

    Raises:
        gazerig.config.load.ConfigError: its file is at fault, or there is none of that name.
        SetupError: they cannot be run as it was asked.
    """
    if options.world is None:
        return False
    return bool(world_scene(options.world, options.seed).figures.script.heads)


def compose_group(options: RunOptions) -> "HeadGroup":
    """Assemble a run of several heads; nothing moves.

    Raises:
        gazerig.config.load.ConfigError: the world or one of the rigs is at fault.
        SetupError: they cannot be run as it was asked.
    """
    if not options.fast:
        raise SetupError(
            f"--world {options.world} has several heads: they run on one simulated clock, with --fast"
        )
    from gazerig.sim_mock.world.physics import World

    first = load_rig(options.rig, options.character, options.profile)
    found = world_of(first, options)
    assert found is not None  # a world was asked for
    assert found.spec.figures is not None  # heads stand in a script
    script = found.spec.figures.script
    each = (
        options,
        *(
            _other(options, name, n, head.rig)
            for n, (name, head) in enumerate(script.heads.items(), 1)
        ),
    )
    lockstep = Lockstep(len(each))
    world = World(found.spec.compiled(), lockstep.now_s)
    frames = [RigFrame(rig.R_world_base, rig.p_world_base_m) for rig in world.model.rigs]
    faces = [
        _face(world, lockstep, number, frame, one.rig)
        for number, (frame, one) in enumerate(zip(frames, each, strict=True))
    ]
    members = []
    for number, (one, frame) in enumerate(zip(each, frames, strict=True)):
        others = [face for n, face in enumerate(faces) if n != number]
        scene = HeadsScene(found.scene, frame, others, number == 0)
        seen = RunWorld(found.spec, scene, found.camera, number, world)
        stands = HeadPlace(frame.R, frame.p_m).numbers
        place = SharedPlace(seen, lockstep.clock(number), stands)
        composed = compose(one, shared=place)
        members.append(_Member((FIRST, *script.heads)[number], composed, frame))
    return HeadGroup(members, lockstep)


def _other(options: RunOptions, name: str, number: int, rig: str) -> RunOptions:
    """Return the options of another head than the first."""
    return replace(
        options,
        rig=rig or options.rig,
        seed=options.seed + number,
        record=None if options.record is None else beside(options.record, name),
        heatmap=None,
        summary=None,
        page=None,
    )


def beside(path: Path, name: str) -> Path:
    """Return the name of the file of another head: run.mcap, run-other.mcap."""
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


def _face(
    world: "World", lockstep: Lockstep, number: int, frame: RigFrame, rig: str
) -> Callable[[], HeadFace]:
    """Return what gives the face of a head now."""
    loaded = load_rig(rig)
    joints = RigInState(kinematics_of(loaded), world.model.rigs[number].qpos)
    poses = SimulatedPoses(world, lockstep.clock(number), joints)
    nose_m = HeadMeasures(loaded.geometry.interocular_mm / 1e3).nose_m

    def now() -> HeadFace:
        R, p_m = frame.in_world(*poses.head(lockstep.now_s()))
        return HeadFace(R, add(p_m, rotate(R, nose_m)))

    return now


class HeadGroup:
    """Several heads that run together; the run is over when the first one's is."""

    def __init__(self, members: Sequence[_Member], lockstep: Lockstep) -> None:
        self._members, self._lockstep = tuple(members), lockstep
        self._over = False
        self._figures: list[dict[str, object] | None] = [None] * len(members)
        self._failures: list[BaseException] = []
        places = [HeadPlace(member.frame.R, member.frame.p_m) for member in members]
        self._traces = [MutualGazeTrace(places[0], other) for other in places[1:]]

    def run(
        self, stopped: Callable[[], str | None], say: Callable[[str], None]
    ) -> dict[str, object]:
        """Run until the first head's run ends; return its figures and those of the others.

        Args:
            stopped: returns the name of a signal that has come, None before.
            say: writes a line.

        Raises:
            SetupError: before anything moved.
        """
        threads = [
            threading.Thread(target=self._follow, args=(number, say), name=member.name)
            for number, member in enumerate(self._members)
            if number
        ]
        for thread in threads:
            thread.start()
        try:
            self._one(0, stopped, say)
        finally:
            self._over = True
            self._lockstep.leave(0)
            for thread in threads:
                thread.join()
        if self._failures:
            raise self._failures[0]
        return self._joined()

    def _follow(self, number: int, say: Callable[[str], None]) -> None:
        """Run another head than the first, in its thread."""
        name = self._members[number].name
        try:
            self._one(number, self._ended, lambda line: say(f"{name}: {line}"))
        except BaseException as error:
            self._failures.append(error)
        finally:
            self._lockstep.leave(number)

    def _one(
        self, number: int, stopped: Callable[[], str | None], say: Callable[[str], None]
    ) -> None:
        self._lockstep.enter(number)
        watch = self._watch(number)
        self._figures[number] = run(self._members[number].composed, stopped, say, watch=watch)

    def _watch(self, number: int) -> Callable[[Tick], None]:
        if number:
            return lambda tick: self._traces[number - 1].update(1, tick)

        def first(tick: Tick) -> None:
            for trace in self._traces:
                trace.update(0, tick)

        return first

    def _ended(self) -> str | None:
        return "the first head ended" if self._over or self._failures else None

    def _joined(self) -> dict[str, object]:
        first, *others = self._figures
        assert first is not None
        names = [member.name for member in self._members[1:]]
        gazes = dict(zip(names, (trace.figures() for trace in self._traces), strict=True))
        return {**first, "mutual_gaze": gazes, "heads": dict(zip(names, others, strict=True))}
