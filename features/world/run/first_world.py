"""Choice of ``make run``: the living room if it can be rendered, else the visitor of a scene.

``python -m gazerig.features.world.run.first_world`` prints the options of ``gazerig run`` for the
room. If the room cannot be rendered, it prints nothing but one line on standard error with the
reason.
"""

import sys
from importlib.util import find_spec

from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.features.world.gl_context import open_context

ROOM = "--world living-room"


def missing_requirement() -> str:
    """Return the missing requirement of a rendered world, "" if nothing is missing."""
    if find_spec("mujoco") is None:
        return extra_hint("mujoco", "world", ModuleNotFoundError(name="mujoco"))
    try:
        _, context, _ = open_context(lambda: None)
    except SetupError as error:
        return str(error)
    context.free()
    return ""


def main() -> None:
    """Print the options, or the missing requirement."""
    needs = missing_requirement()
    if needs:
        sys.stderr.write(f"a visitor without a room; for the room ({ROOM}): {needs}\n")
    else:
        sys.stdout.write(f"{ROOM}\n")


if __name__ == "__main__":
    main()
