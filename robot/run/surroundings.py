"""Surroundings of an emulated rig: servo mechanics, camera view and appearance.

``gazerig run --world NAME`` runs in them. A package provides its own by an entry point of the group
``gazerig.surroundings``, which names a subclass of ``Surroundings``.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import SURROUNDINGS, find, is_ours, registrations

if TYPE_CHECKING:
    import numpy as np

    from gazerig.config.rig import Rig
    from gazerig.drivers.types import Camera
    from gazerig.robot.dashboard.feed.world_shapes import WorldShapes
    from gazerig.robot.model.clock import Clock
    from gazerig.robot.model.frames import CameraParams
    from gazerig.robot.run.options import RunOptions
    from gazerig.robot.run.program_parts import ProgramParts
    from gazerig.robot.run.run_bus import CameraPoses, RunBus
    from gazerig.sim_mock.scenes.scene import Scene

WORLD = "world"
"""Our own surroundings, which handle all names that no package has."""


class RunRoom(Protocol):
    """Surroundings of one run; the rig's emulated servos are in them."""

    @property
    def scene(self) -> "Scene":
        """Return the people and things in it, for scores and the page."""

    @property
    def clock(self) -> "Clock":
        """Return the clock of the run."""

    @property
    def run_bus(self) -> "RunBus":
        """Return the bus of the rig's servos; its ``close`` ends the surroundings."""

    def camera(
        self,
        rig: "Rig",
        options: "RunOptions",
        sight: "CameraPoses",
        placed: "CameraParams",
        rng: "np.random.Generator",
        own: "ProgramParts",
        say: Callable[[str], None],
    ) -> "Camera":
        """Return the rig's camera; called only once.

        Args:
            rig: Rig with the parameters of detectors.
            options: Options of the run.
            sight: Placement of the camera, and history of its rotation.
            placed: Present parameters of the camera.
            rng: Random numbers of its noise.
            own: Camera and detector of a program.
            say: Receives messages for the user.
        """

    def start_s(self) -> float | None:
        """Return the start of its script on the clock of the ticks, None before it."""

    def shapes(self) -> "WorldShapes | None":
        """Return its appearance for the page, None if it is not shown."""


class Surroundings(ABC):
    """Surroundings of a run; constructed without arguments."""

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
            options: Options of the run; ``options.world`` names the surroundings.
            clock: Clock of the run.

        Raises:
            SetupError: they cannot be used.
        """

    def names(self) -> tuple[str, ...]:
        """Return the names for shell completion of ``--world``."""
        return ()


def surroundings(name: str) -> Surroundings:
    """Return the surroundings of a name or path: a package's of that name, otherwise our world.

    Raises:
        PluginError: they cannot be imported, or several packages have this name.
    """
    outside = any(one.name == name and not one.is_ours for one in registrations(SURROUNDINGS))
    found = find(SURROUNDINGS, name if outside and not is_ours(SURROUNDINGS, name) else WORLD)
    part = found.load()
    if isinstance(part, type) and issubclass(part, Surroundings):
        return part()
    raise PluginError(f"{found.label} is not a subclass of {Surroundings.__module__}.Surroundings")


def surroundings_names() -> list[str]:
    """Return the names for ``--world``, ours and packages', without missing ones."""
    names: list[str] = []
    for one in registrations(SURROUNDINGS):
        if not one.is_ours:
            names.append(one.name)
            continue
        try:
            names += surroundings(one.name).names()
        except PluginError:
            continue
    return names
