"""OpenGL without a display: EGL or OSMesa, whichever works here.

MuJoCo renders through one of several libraries. Machines differ in which one is installed, and each
library reports failures differently, so both are tried and every failure is reported.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any, TypeVar

from gazerig.drivers.errors import SetupError, install_command

_PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}
_chosen = ""  # the first that worked: a process loads OpenGL only once

Made = TypeVar("Made")


class NoRenderer(SetupError):
    """No library can render here; the message lists what was tried and why each failed."""


def open_context(make: Callable[[], Made]) -> tuple[Any, Made]:
    """Return a context of the first library that works, and what was made while it was current.

    If the user has set MUJOCO_GL, only that library is tried.

    Args:
        make: called with a context current; raises if the context is not good enough.

    Raises:
        NoRenderer: none works.
    """
    global _chosen
    wanted, why = os.environ.get("MUJOCO_GL") or _chosen, dict[str, str]()
    for backend in (wanted,) if wanted else _PACKAGES:
        # MuJoCo reads the variable again when it looks for the library's functions.
        with _environment("MUJOCO_GL", backend):
            try:
                with ExitStack() as kept:
                    context = import_module(f"mujoco.{backend}").GLContext(64, 64)
                    kept.callback(context.free)
                    # No longer than necessary: another thread may render
                    with context.as_current():
                        made = make()
                    kept.pop_all()
            except Exception as error:  # each library has its own errors
                why[backend] = _one_line(error)
                _forget_opengl()
                continue
        _chosen = backend
        return context, made
    tried = "; ".join(f"{backend}: {reason}" for backend, reason in why.items())
    raise NoRenderer(
        f"no pictures of a world: nothing here can render ({tried}); cure: apt install "
        f"{' or '.join(_PACKAGES.values())}, or run with --no-pictures"
    )


def render_in_calling_thread() -> None:
    """Make Mesa's llvmpipe render without its own threads, unless the user has set their number.

    Call this before the first context of the process. The threads, one per core, wake on every core
    simultaneously for a few milliseconds per picture and delay the threads that wait for servos,
    regardless of their priority: on two cores 290 to 320 of 6,000 ticks of 200 Hz (133 of 4,000
    with one thread), in the calling thread 10 of 4,000. Both render 28 pictures a second. On the
    simulated clock nothing can be late.
    """
    os.environ.setdefault("LP_NUM_THREADS", "0")


def import_mujoco() -> ModuleType:
    """Import MuJoCo without a check of what can render, and return its module.

    With MUJOCO_GL set, MuJoCo fails to import if that library is missing, even if nothing is
    rendered.

    Raises:
        SetupError: MuJoCo is not installed.
    """
    with _environment("MUJOCO_GL", "off"):
        try:
            return import_module("mujoco")
        except ImportError as error:
            hint = install_command("world")
            raise SetupError(f"a world needs MuJoCo ({_one_line(error)}): {hint}") from error


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Set an environment variable temporarily."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def _forget_opengl() -> None:
    """Unload PyOpenGL, which binds itself to the first library that it loads."""
    for name in [*sys.modules]:
        if name.split(".")[0] == "OpenGL" or name.startswith(("mujoco.egl", "mujoco.osmesa")):
            del sys.modules[name]
    os.environ.pop("PYOPENGL_PLATFORM", None)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__
