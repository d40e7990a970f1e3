"""Plug-ins: parts of packages, found by group and name, and loaded when they are used.

A package registers a part by an entry point. Our own parts are listed in ``SHIPPED`` in the same
form and are found by the same code, but without a search of the installed packages, which takes
some milliseconds. Nothing is imported before its name is used.
"""

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from operator import attrgetter
from traceback import walk_tb
from typing import TYPE_CHECKING, Any, TypeVar

from gazerig.drivers.errors import DriverError, PluginError, SetupError
from gazerig.params import unknown_text

if TYPE_CHECKING:
    from gazerig.drivers.bus.servo_models import ServoModelInfo
    from gazerig.drivers.serial.port import BusPort

BUS, CAMERA, DETECTOR = "gazerig.bus", "gazerig.camera", "gazerig.detector"
ATTENTION = "gazerig.attention"
COMMAND, PAGE_PANEL = "gazerig.command", "gazerig.page_panel"
SURROUNDINGS, DOOR = "gazerig.surroundings", "gazerig.door"
GROUPS: Mapping[str, str] = {
    BUS: "bus",
    CAMERA: "camera",
    DETECTOR: "detector",
    ATTENTION: "attention",
    COMMAND: "command",
    SURROUNDINGS: "surroundings",
    PAGE_PANEL: "page panel",
    DOOR: "door",
}
"""Group of entry points -> its name in messages."""

SHIPPED: Mapping[str, Mapping[str, str]] = {
    BUS: {
        "dynamixel": "gazerig.drivers.bus.bus_plugins:DYNAMIXEL",
        "feetech": "gazerig.drivers.bus.bus_plugins:FEETECH",
        "maestro": "gazerig.drivers.bus.bus_plugins:MAESTRO",
        "pca9685": "gazerig.drivers.bus.bus_plugins:PCA9685",
    },
    CAMERA: {
        "webcam": "gazerig.drivers.camera.camera_plugins:WEBCAM",
        "oak": "gazerig.drivers.camera.camera_plugins:OAK",
    },
    DETECTOR: {
        "auto": "gazerig.drivers.vision.face.detector:AUTO",
    },
    ATTENTION: {"attention": "gazerig.gaze.attention.attention:Attention"},
    COMMAND: {
        "report": "gazerig.features.lab.commands:REPORT",
        "sweep": "gazerig.features.lab.commands:SWEEP",
        "study": "gazerig.features.study.commands:STUDY",
        "scan": "gazerig.features.bringup.commands:SCAN",
        "setup": "gazerig.features.bringup.commands:SETUP",
        "doctor": "gazerig.features.bringup.commands:DOCTOR",
        "calibrate": "gazerig.features.bringup.commands:CALIBRATE",
        "jog": "gazerig.features.bringup.commands:JOG",
        "monitor": "gazerig.features.bringup.commands:MONITOR",
        "record-track": "gazerig.features.bringup.commands:RECORD_TRACK",
        "fit-scanpath": "gazerig.features.lab.commands:FIT_SCANPATH",
        "import": "gazerig.features.animation.commands:IMPORT",
    },
    PAGE_PANEL: {},
    SURROUNDINGS: {"world": "gazerig.features.world.run.surroundings:WorldSurroundings"},
    DOOR: {
        "voice-assistant": "gazerig.doors.voice_assistant:DOOR",
        "wyoming": "gazerig.doors.wyoming:DOOR",
        "pipecat": "gazerig.doors.pipecat:DOOR",
        "livekit": "gazerig.doors.livekit:DOOR",
        "openai-realtime": "gazerig.doors.openai_realtime:DOOR",
    },
}
"""Our own parts, in the form of an entry point: group -> name -> "module:attribute".

A command is a ``gazerig.robot.cli.command_list.CommandEntry``, surroundings
``gazerig.features.world.run.surroundings.WorldSurroundings``, a door a ``gazerig.doors.door.Door``.
"""

OUR_PACKAGE = "gazerig"


@dataclass(frozen=True)
class NoParams:
    """The section of a part that has no parameters."""


@dataclass(frozen=True)
class Plugin:
    """A part that can be created by its name.

    Attributes:
        make: Creates it from its parameters.
        params: Dataclass of its section in the rig file; the section has the part's name.
    """

    make: Callable[..., Any]
    params: type = NoParams


@dataclass(frozen=True)
class CameraPlugin(Plugin):
    """A kind of camera; its section is at the top of the rig file.

    ``make`` returns a ``gazerig.drivers.camera.source.FrameSource`` (frames, which the rig's own
    detectors search) or a ``gazerig.drivers.types.Camera`` (detections).
    """


@dataclass(frozen=True)
class DetectorPlugin(Plugin):
    """A kind of face detector; its section is below ``detector``.

    ``make`` returns a ``gazerig.drivers.types.FaceDetector``.
    """


@dataclass(frozen=True)
class AttentionPlugin(Plugin):
    """A rule that selects the person to look at; its section is below ``gaze``.

    ``make`` returns a ``gazerig.robot.loop.chooser.Chooser``.
    """


@dataclass(frozen=True)
class BusPlugin(Plugin):
    """A kind of servo bus; its section is below ``bus``, and has a field ``baud``.

    ``make`` is given a ``gazerig.drivers.serial.port.BusPort``, the servos' ``ServoConfig`` and the
    parameters. It returns a ``gazerig.drivers.types.ServoBus``.

    Attributes:
        models: Its servo models, by the name used in a joint.
        device: Creates the emulated device (``gazerig.sim_mock.device.Device``) for --mock from the
            parameters, the servos, a clock and a seed; None if there is none.
        release: Switches the torque of servos off, given the port, the parameters and the ids.
            Returns the ids that did not confirm. The guardian calls it when the program dies. None:
            the servos stop without it.
    """

    models: "Mapping[str, ServoModelInfo]" = field(default_factory=dict)
    device: "Callable[[Any, tuple[EmulatedJoint, ...], Callable[[], float], int], Any] | None" = (
        None
    )
    release: "Callable[[BusPort, Any, tuple[int, ...]], tuple[int, ...]] | None" = None


@dataclass(frozen=True)
class EmulatedJoint:
    """One servo of an emulated bus.

    Attributes:
        id: Servo id.
        model: Model name, as in the rig file.
        start_steps: Position of its shaft at the start.
        stop_low_steps, stop_high_steps: Mechanical end stops.
    """

    id: int
    model: str
    start_steps: float
    stop_low_steps: float
    stop_high_steps: float


@dataclass(frozen=True)
class Registration:
    """A part as registered, not loaded yet.

    Attributes:
        group: One of ``GROUPS``.
        name: Name by which it is used.
        value: "module:attribute", as in an entry point.
        package, version: Package that includes it.
    """

    group: str
    name: str
    value: str
    package: str
    version: str = ""

    @property
    def is_ours(self) -> bool:
        """Return whether it comes with gazerig."""
        return self.package == OUR_PACKAGE

    @property
    def maker(self) -> str:
        """Return package and version, as messages name them."""
        return f"{self.package} {self.version}".rstrip()

    @property
    def label(self) -> str:
        """Return the part as messages name it: "camera 'fish' of fishcam 1.2"."""
        return f"{GROUPS[self.group]} {self.name!r} of {self.maker}"

    def load(self) -> object:
        """Return the object that the entry point names.

        Raises:
            PluginError: it cannot be imported or does not exist.
        """
        module, _, attribute = self.value.partition(":")
        try:  # importlib.metadata, which does the same, takes 15 ms to import
            part = import_module(module.strip())
            return attrgetter(attribute.strip())(part) if attribute else part
        except (Exception, SystemExit) as error:  # an import may raise anything
            raise PluginError(f"{self.label} cannot be loaded: {describe_error(error)}") from error


def describe_error(error: BaseException) -> str:
    """Return an exception of a package as part of one line."""
    text = " ".join(str(error).split())[:200]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def plugin_error(error: BaseException) -> PluginError | None:
    """Return an error that names the part of another package which raised it, None for others."""
    if isinstance(error, DriverError):
        return None
    frames = [frame for frame, _ in walk_tb(error.__traceback__)]
    raising = {str(frame.f_globals.get("__name__")).partition(".")[0] for frame in frames}
    for group in GROUPS:
        for part in _package_parts(group, tuple(sys.path)):
            if re.split(r"[.:\s]", part.value)[0] in raising:
                return PluginError(f"{part.label} failed ({describe_error(error)})")
    return None


def registrations(group: str) -> tuple[Registration, ...]:
    """Return all parts of a group: ours, then those of packages by package and name."""
    return (
        *(Registration(group, name, value, OUR_PACKAGE) for name, value in SHIPPED[group].items()),
        *_package_parts(group, tuple(sys.path)),
    )


def is_ours(group: str, name: str) -> bool:
    """Return whether gazerig includes a part of this name."""
    return name in SHIPPED[group]


def find(group: str, name: str) -> Registration:
    """Return the part of a name; our own parts come first.

    Raises:
        PluginError: no package, or more than one, has such a part; the message lists them.
    """
    if is_ours(group, name):
        return Registration(group, name, SHIPPED[group][name], OUR_PACKAGE)
    there = _package_parts(group, tuple(sys.path))
    found = [one for one in there if one.name == name]
    if len(found) == 1:
        return found[0]
    what = GROUPS[group]
    if found:
        makers = " and ".join(one.maker for one in found)
        raise PluginError(f"{what} {name!r} comes with {makers}: uninstall one of them")
    names = [*SHIPPED[group], *dict.fromkeys(one.name for one in there)]
    raise PluginError(unknown_text(what, name, names))


P = TypeVar("P", bound=Plugin)


def load(group: str, name: str, kind: type[P]) -> P:
    """Import and return the part of a name; a plain class or function is a part without parameters.

    Raises:
        PluginError: it does not exist, cannot be imported, or is of another type.
    """
    found = find(group, name)
    part = _load_cached(found)
    if isinstance(part, kind):
        return part
    if callable(part) and kind is not BusPlugin:
        without = part
        return kind(make=lambda params: without())
    raise PluginError(f"{found.label} is a {type(part).__name__}, wanted a {kind.__name__}")


@cache
def _load_cached(found: Registration) -> object:
    return found.load()


def create(group: str, name: str, part: Plugin, params: Any) -> Any:
    """Create a part from its parameters.

    Raises:
        SetupError: raised by the part itself.
        PluginError: the part raises any other error.
    """
    try:
        return part.make(params)
    except SetupError:
        raise
    except Exception as error:
        raise PluginError(
            f"{find(group, name).label} cannot be created: {describe_error(error)}"
        ) from error


@cache
def _package_parts(group: str, path: tuple[str, ...]) -> tuple[Registration, ...]:
    """Return the parts of installed packages; path: search path of modules."""
    from importlib.metadata import entry_points

    found = []
    for one in entry_points(group=group):
        package = one.dist.name if one.dist is not None else one.module.partition(".")[0]
        if package != OUR_PACKAGE:
            version = one.dist.version if one.dist is not None else ""
            found.append(Registration(group, one.name, one.value, package, version))
    return tuple(sorted(found, key=lambda one: (one.package, one.name)))
