"""The content of a world as plain data that can be sent to another process."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gazerig.features.world.figure import Figures
from gazerig.features.world.gl_context import import_mujoco
from gazerig.features.world.rig_in_world import RigInWorld

if TYPE_CHECKING:
    from gazerig.features.world.model import WorldModel


_STATE, _PEOPLE = "state", "people.npy"
"""Files in the folder of a server: newest state, people's motion."""


class WorldSpec(NamedTuple):
    """Content of a world: a room, its people and the rig in it.

    Attributes:
        figures: the people, whose script defines the room.
        rig: the rig.
        mjcf_file: a user's own world instead of the room.
    """

    figures: Figures
    rig: RigInWorld
    mjcf_file: Path | None = None

    def compile(self) -> "WorldModel":
        """Compile the world for MuJoCo; the result is the same in every process.

        Raises:
            SetupError: the user's file cannot be used; the message names the file and the remedy.
        """
        import_mujoco()  # independent of MUJOCO_GL
        from gazerig.features.world.model import world_model

        return world_model(self.figures, self.rig, self.mjcf_file)

    def with_shared_file(self, folder: Path) -> "WorldSpec":
        """Return the same world with its people's motion in a file of the folder."""
        return self._replace(figures=self.figures.with_shared_file(folder / _PEOPLE))


def state_file(folder: Path) -> Path:
    """Return the file of the newest state of a world, in the folder of its server."""
    return folder / _STATE
