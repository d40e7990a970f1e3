"""Surroundings of an emulated rig: its servos' mechanics, what its camera sees, how it looks.

``gazerig run --world NAME`` runs in them. A package brings some by an entry point of the group
``gazerig.surroundings``, which names a subclass of ``Surroundings``.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from gazerig.drivers.errors import PluginError, SetupError
from gazerig.drivers.plugins import SURROUNDINGS, find, is_ours, registrations

if TYPE_CHECKING:
    import numpy as np

    from gazerig.config.rig import Rig
    from gazerig.drivers.types import Camera
    from gazerig.robot.app.options import RunOptions
    from gazerig.robot.app.program_parts import ProgramParts
    from gazerig.robot.app.run_parts import RunBus, Sight
    from gazerig.robot.control.tick import Tick
    from gazerig.robot.description.world_shapes import WorldShapes
    from gazerig.robot.model.clock import Clock
    from gazerig.robot.model.frames import CameraParams
    from gazerig.robot.recording.world_info import WorldInfo
    from gazerig.sim_mock.scenes.scene import Scene

WORLD = "world"
"""Our own surroundings: they have all names that no package has."""


class RunRoom(Protocol):
    """Surroundings of one run; the rig's emulated servos are in them."""

    @property
    def scene(self) -> "Scene":
        """Return the people and things in it, for scores and the page."""
        ...

    @property
    def clock(self) -> "Clock":
        """Return the clock of the run."""
        ...

    @property
    def wires(self) -> "RunBus":
        """Return the bus of the rig's servos; its ``close`` ends the surroundings."""
        ...

    @property
    def stands(self) -> tuple[float, ...]:
        """Return where the rig is, as of ``RunInfo.stands``; () at the origin."""
        ...

    def camera(
        self,
        rig: "Rig",
        options: "RunOptions",
        sight: "Sight",
        placed: "CameraParams",
        rng: "np.random.Generator",
        own: "ProgramParts",
        say: Callable[[str], None],
    ) -> "Camera":
        """Return the rig's camera; called once.

        Args:
            rig: with the parameters of detectors.
            options: of the run.
            sight: where the camera is, and how it was turned when.
            placed: the camera as it is believed.
            rng: for its noise.
            own: camera and detector of a program.
            say: gets what a person should know.
        """
        ...

    def start_s(self) -> float | None:
        """Return when its script began, on the clock of the ticks, None before that."""
        ...

    def shapes(self) -> "WorldShapes | None":
        """Return how it looks, for the page; None: it is not shown."""
        ...

    def recorded(self) -> "WorldInfo | None":
        """Return what a recording keeps of it, None before its script began or for nothing."""
        ...


class GroupRun(Protocol):
    """A run of several heads."""

    def run(
        self,
        stopped: Callable[[], str | None],
        say: Callable[[str], None],
        status: Callable[[str], None] | None = None,
        watch: "Callable[[Tick], object] | None" = None,
        browse: Callable[[str], object] | None = None,
    ) -> dict[str, object]:
        """Run; arguments and figures as of ``gazerig.robot.app.session.run``."""
        ...


@runtime_checkable
class RoomCamera(Protocol):
    """A camera of a room that looks through another one."""

    @property
    def seeing(self) -> "Camera | None":
        """Return the camera that looks, None before it is known."""
        ...

    @property
    def start_s(self) -> float | None:
        """Return when the scene before it began, None before that."""
        ...


class Surroundings(ABC):
    """Surroundings that a run may be in; made without arguments."""

    @abstractmethod
    def scene(self, options: "RunOptions") -> "Scene":
        """Return the people and things in the surroundings of a run; nothing is started.

        Raises:
            SetupError: they cannot be used.
        """

    @abstractmethod
    def open(self, rig: "Rig", options: "RunOptions", clock: "Clock") -> RunRoom:
        """Return the surroundings of a run, with the rig's emulated servos in them.

        Args:
            rig: the rig.
            options: of the run; ``options.world`` names them.
            clock: of the run.

        Raises:
            SetupError: they cannot be used.
        """

    def names(self) -> tuple[str, ...]:
        """Return the names that a shell completes after ``--world``."""
        return ()

    def group(self, options: "RunOptions") -> GroupRun | None:
        """Return the run of several heads, None if there is one head in them.

        Raises:
            SetupError: they cannot be used.
        """
        return None

    def replayed(self, info: "WorldInfo", stands: tuple[float, ...]) -> "WorldShapes":
        """Return how the surroundings of a recorded run looked, as from its head's neck base.

        Args:
            info: what ``RunRoom.recorded`` returned.
            stands: where the head was, as of ``RunInfo.stands``.

        Raises:
            SetupError: they cannot be shown; says why.
        """
        raise SetupError(f"the surroundings {info.name} are not shown: they keep no shapes")


def surroundings(name: str) -> Surroundings:
    """Return the surroundings of a name or path: a package's of that name, else our world.

    Raises:
        PluginError: they cannot be imported, or several packages have this name.
    """
    outside = any(one.name == name and not one.ours for one in registrations(SURROUNDINGS))
    found = find(SURROUNDINGS, name if outside and not is_ours(SURROUNDINGS, name) else WORLD)
    part = found.load()
    if isinstance(part, type) and issubclass(part, Surroundings):
        return part()
    raise PluginError(f"{found.label} is no subclass of {Surroundings.__module__}.Surroundings")


def surroundings_names() -> list[str]:
    """Return the names after ``--world``, ours and packages', without those that are missing."""
    names: list[str] = []
    for one in registrations(SURROUNDINGS):
        if not one.ours:
            names.append(one.name)
            continue
        try:
            names += surroundings(one.name).names()
        except PluginError:
            continue
    return names
