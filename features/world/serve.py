"""Entry point of a server's world; light, so that MuJoCo is imported only on use."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gazerig.features.world.gl_context import import_mujoco
from gazerig.features.world.world_spec import WorldSpec, state_file

if TYPE_CHECKING:
    from gazerig.features.world.served_world import ServedWorld


@dataclass(frozen=True)
class SentWorld:
    """World that is sent to a server's process, and the folder of its files."""

    spec: WorldSpec
    folder: Path

    def __call__(self, clock_s: Callable[[], float]) -> "ServedWorld":
        """Return the world of a server.

        Raises:
            SetupError: MuJoCo is not installed, or a user's own world cannot be used.
        """
        import_mujoco()  # whatever MUJOCO_GL permits
        from gazerig.features.world.served_world import ServedWorld

        return ServedWorld(self.spec, state_file(self.folder), clock_s)
