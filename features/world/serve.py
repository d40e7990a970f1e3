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
    """``SentSurroundings`` of gazerig.sim_mock.pty.client."""

    spec: WorldSpec

    def in_folder(self, folder: Path) -> "SentWorld":
        """Return the world that shares its files in a folder."""
        return SentWorld(self.spec.with_shared_file(folder))

    def serve(self, folder: Path, clock_s: Callable[[], float]) -> "ServedWorld":
        """Return the world of a server.

        Raises:
            SetupError: MuJoCo is not installed, or a user's own world cannot be used.
        """
        import_mujoco()  # whatever MUJOCO_GL permits
        from gazerig.features.world.served_world import ServedWorld

        return ServedWorld(self.spec, state_file(folder), clock_s)
