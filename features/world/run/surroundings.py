"""Our worlds as surroundings of a run: ``gazerig run --world``."""

from typing import TYPE_CHECKING

from gazerig.config.rig import Rig
from gazerig.config.shipped_files import shipped_names
from gazerig.features.world.room import HOME
from gazerig.robot.model.clock import Clock
from gazerig.robot.run.options import RunOptions
from gazerig.sim_mock.scenes.scene import Scene

if TYPE_CHECKING:
    from gazerig.features.world.run.rig_room import RigRoom


class WorldSurroundings:
    """A world with physics, from a script's name or path or from a user's own MJCF file.

    Modules are imported on use: those with MuJoCo and people are heavy.
    """

    def scene(self, options: RunOptions) -> Scene:
        """Return the people of the requested world."""
        from gazerig.features.world.run.run_world import world_scene

        return world_scene(str(options.world), options.seed)

    def open(self, rig: Rig, options: RunOptions, clock: Clock) -> "RigRoom":
        """Return the requested world with the rig in it."""
        from gazerig.features.world.run.rig_room import open_room
        from gazerig.features.world.run.run_world import world_of

        return open_room(rig, options, clock, world_of(rig, options))

    def names(self) -> tuple[str, ...]:
        """Return the names of the shipped worlds."""
        return shipped_names("worlds", HOME)
