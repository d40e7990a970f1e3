"""Entry point of a server's world; light, so that MuJoCo is imported only on use."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from gazerig.features.world.gl_context import import_mujoco
from gazerig.features.world.world_spec import WorldSpec, state_file

if TYPE_CHECKING:
    from gazerig.sim_mock.pty.server import ServedSurroundings


def serve(folder: Path, clock_s: Callable[[], float]) -> "ServedSurroundings":
    """Return the world of a server, as of ``SentSurroundings.make``.

    Raises:
        SetupError: MuJoCo is not installed, or a user's own world cannot be used.
    """
    import_mujoco()  # whatever MUJOCO_GL permits
    from gazerig.features.world.served_world import ServedWorld

    return ServedWorld(WorldSpec.read(folder), state_file(folder), clock_s)
