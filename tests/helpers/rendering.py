"""Whether worlds can be rendered here: tests that need it are skipped with the reason elsewhere."""

from functools import cache

import pytest


@cache
def why_not() -> str:
    """Return why nothing can render here, "" where something can."""
    from gazerig.drivers.errors import SetupError

    try:
        from gazerig.features.world.gl_context import import_mujoco
    except ModuleNotFoundError as error:
        return str(error)
    try:
        mujoco = import_mujoco()
        from gazerig.features.world.renderer import Renderer

        Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16).close()
    except SetupError as error:
        return str(error)
    return ""


@pytest.fixture(scope="session")
def renders() -> None:
    """Skip the test without a renderer."""
    if reason := why_not():
        pytest.skip(reason)
