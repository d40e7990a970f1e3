"""What a world is made of, as plain data that can be sent to another process."""

import pickle
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gazerig.features.world.figure import Figures
from gazerig.features.world.gl_context import import_mujoco
from gazerig.features.world.rig_in_world import RigInWorld

if TYPE_CHECKING:
    from gazerig.features.world.model import WorldModel


class WorldSpec(NamedTuple):
    """A room, its people and the rigs in it.

    Attributes:
        figures: the people, and by their script the room; None for nobody on an empty floor.
        rigs: the first is the one that the program leads.
        mjcf_file: a user's own world instead of the room.
    """

    figures: Figures | None
    rigs: tuple[RigInWorld, ...]
    mjcf_file: Path | None = None

    def compiled(self) -> "WorldModel":
        """Return it for MuJoCo; the same in every process.

        Raises:
            SetupError: the user's file cannot be used; names the file and the remedy.
        """
        import_mujoco()  # whatever MUJOCO_GL says of pictures
        from gazerig.features.world.model import world_model

        return world_model(self.figures, self.rigs, self.mjcf_file)

    def write(self, path: Path) -> None:
        """Write it to a file for another process of this program."""
        path.write_bytes(pickle.dumps(self))

    @staticmethod
    def read(path: Path) -> "WorldSpec":
        """Read what ``write`` has written; never a file of somebody else's."""
        found: WorldSpec = pickle.loads(path.read_bytes())
        return found
