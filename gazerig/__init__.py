"""Controls an animatronic head that looks at people as people look at each other.

with gazerig.open("desk", mock=True) as head:
    head.look_at(1.0, 0.2, 0.3).wait()

The names in ``__all__`` are stable; every change to them is listed in the changelog.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gazerig import aio as aio
    from gazerig.config.faults import ConfigError as ConfigError
    from gazerig.config.schema import load_rig as load_rig
    from gazerig.drivers.errors import SetupError as SetupError
    from gazerig.errors import Error as Error
    from gazerig.errors import HeadEnded as HeadEnded
    from gazerig.errors import NotFound as NotFound
    from gazerig.errors import Refused as Refused
    from gazerig.geometry import HeadPose as HeadPose
    from gazerig.geometry import JointSolution as JointSolution
    from gazerig.geometry import forward as forward
    from gazerig.geometry import inverse as inverse
    from gazerig.head import Head as Head
    from gazerig.head import Order as Order
    from gazerig.local_head import SimulatedHead as SimulatedHead
    from gazerig.opening import open as open
    from gazerig.remote_head import connect as connect
    from gazerig.robot.loop.head_state import GazeReading as GazeReading
    from gazerig.robot.loop.head_state import HeadEvent as HeadEvent
    from gazerig.robot.loop.head_state import HeadState as HeadState
    from gazerig.robot.loop.head_state import JointReading as JointReading
    from gazerig.robot.loop.head_state import Person as Person
    from gazerig.robot.model.reply import CHARACTERS_PER_S as CHARACTERS_PER_S
    from gazerig.robot.model.reply import Outcome as Outcome

    __version__: str

_HOME = {
    "CHARACTERS_PER_S": "gazerig.robot.loop.client_control",
    "ConfigError": "gazerig.config.faults",
    "Error": "gazerig.errors",
    "GazeReading": "gazerig.robot.loop.head_state",
    "Head": "gazerig.head",
    "HeadEnded": "gazerig.errors",
    "HeadEvent": "gazerig.robot.loop.head_state",
    "HeadPose": "gazerig.geometry",
    "HeadState": "gazerig.robot.loop.head_state",
    "JointReading": "gazerig.robot.loop.head_state",
    "JointSolution": "gazerig.geometry",
    "NotFound": "gazerig.errors",
    "Order": "gazerig.head",
    "Outcome": "gazerig.robot.model.reply",
    "Person": "gazerig.robot.loop.head_state",
    "Refused": "gazerig.errors",
    "SetupError": "gazerig.drivers.errors",
    "SimulatedHead": "gazerig.local_head",
    "connect": "gazerig.remote_head",
    "forward": "gazerig.geometry",
    "inverse": "gazerig.geometry",
    "load_rig": "gazerig.config.schema",
    "open": "gazerig.opening",
}
"""Name -> module, imported at first use: a short command must not wait for all of them."""

__all__ = sorted(_HOME)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("gazerig")
    if name == "aio":  # a module, imported at first use as well
        return import_module("gazerig.aio")
    if name in _HOME:
        found = getattr(import_module(_HOME[name]), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
