"""Choice of ``make run``: what this computer can run, in the living room or with a scene's visitor.

``python -m gazerig.features.world.run.first_world`` prints the options of ``gazerig run``. If the
room cannot be rendered, one line on standard error gives the reason.
"""

import sys
from importlib.util import find_spec

from gazerig.drivers.errors import SetupError, extra_hint
from gazerig.features.world.gl_context import open_context
from gazerig.robot.cli.computer import load_level, measure
from gazerig.robot.run.options import LEVELS

ROOM = "--world living-room"
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software")


def renderer_name() -> tuple[str, str]:
    """Return the name of the renderer, and the missing requirement of a rendered world, or ""."""
    if find_spec("mujoco") is None:
        return "", extra_hint("mujoco", "world", ModuleNotFoundError(name="mujoco"))
    try:
        context, name = open_context(_opengl_name)
    except SetupError as error:
        return "", str(error)
    context.free()
    return name, ""


def _opengl_name() -> str:
    from OpenGL import GL  # type: ignore[import-untyped]  # reads which library was chosen

    return bytes(GL.glGetString(GL.GL_RENDERER) or b"").decode(errors="replace")


def main() -> None:
    """Print the options, or the missing requirement."""
    name, needs = renderer_name()
    if needs:
        sys.stderr.write(f"a visitor without a room; for the room ({ROOM}): {needs}\n")
    software = None if needs else any(word in name.lower() for word in _SOFTWARE)
    level = load_level(measure(software))
    room = f" {ROOM}" if LEVELS[level].room and not needs else ""
    sys.stdout.write(f"--computer {level}{room}\n")


if __name__ == "__main__":
    main()
