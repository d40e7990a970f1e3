"""What ``make run`` shows: the living room where it can be rendered, else the visitor of a scene.

``python -m gazerig.features.world.run.first_world`` prints the options of ``gazerig run`` that show
the room, or nothing, and then says on standard error in one line what the room needs.
"""

import sys
from importlib.util import find_spec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.extras import extra_hint
from gazerig.features.world.gl_context import open_context

ROOM = "--world living-room"


def what_it_needs() -> str:
    """Return what a rendered world lacks here, "" where nothing is missing."""
    if find_spec("mujoco") is None:
        return extra_hint("mujoco", "world", ModuleNotFoundError(name="mujoco"))
    try:
        _, context, _ = open_context(lambda: None)
    except SetupError as error:
        return str(error)
    context.free()
    return ""


def main() -> None:
    """Print the options, or what is missing."""
    needs = what_it_needs()
    if needs:
        sys.stderr.write(f"a visitor without a room; for the room ({ROOM}): {needs}\n")
    else:
        sys.stdout.write(f"{ROOM}\n")


if __name__ == "__main__":
    main()
