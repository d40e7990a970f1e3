"""Options of one run: one value from the command line to the assembly."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.params import unknown_text
from gazerig.robot.dashboard.door.token_file import read_token

DEFAULT_SCENE = "visitor"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,31}")
BUSES = ("emulated", "ideal")
"""Replacements of the servos: byte-true emulators, or servos without bytes."""


class LoadLevel(NamedTuple):
    """A load level of a computer.

    Attributes:
        rate_hz: highest rate of the loop, None for the rig's.
        pictures: pictures of the camera in a world: "full", "coarse" (15 per second, without
            smoothed edges) or "none" (detections are computed).
        room: whether ``make run`` is in a room with physics.
        text: Description of the level.
    """

    rate_hz: float | None
    pictures: str
    room: bool
    text: str


LEVELS = {
    "full": LoadLevel(None, "full", True, "the rig's loop rate, full pictures"),
    "small": LoadLevel(100.0, "coarse", True, "a loop of 100 Hz, 15 coarse pictures a second"),
    "busy": LoadLevel(100.0, "none", True, "a loop of 100 Hz, a room without rendered pictures"),
    "least": LoadLevel(50.0, "none", False, "a loop of 50 Hz, a scene instead of a room"),
}
"""Load levels by name, from the highest to the lowest."""


def level_text(name: str) -> str:
    """Return a description of a level in one line, with the options that override it."""
    return (
        f"measured for this computer ({name}): {LEVELS[name].text}; --rate and --world override it"
    )


class Option(NamedTuple):
    """Description of a field of ``RunOptions``, which is also an option of ``gazerig run``.

    help: its meaning
    value: name of its value in the help, "" for its type
    low, high: range of a number
    name: name of the option, "" for that of the field
    is_shown: whether the help of the command lists it
    """

    help: str
    value: str = ""
    low: float | None = None
    high: float | None = None
    name: str = ""
    is_shown: bool = True


@dataclass(frozen=True)
class RunOptions:
    """Options of a run: rig, scene, observers and outputs; None if not given."""

    # fmt: off
    mock: Annotated[bool, Option("Emulated servos instead of the rig's.")] = False
    fast: Annotated[bool, Option("Simulated time, as fast as possible; needs --mock.")] = False
    seed: Annotated[int, Option("Seed of all random numbers.", "N", 0)] = 0
    scene: Annotated[str | None, Option("Simulated people; with --mock: visitor.", "NAME|FILE")] = None
    world: Annotated[str | None, Option("World with physics: living-room, boxing ...", "NAME|FILE")] = None
    camera: Annotated[int | str | None, Option("Webcam N, or the camera NAME of a package.", "N|NAME")] = None
    oak: Annotated[bool, Option("OAK-D camera.")] = False
    video: Annotated[Path | None, Option("Film, image or recording of a camera, in a loop.", "FILE")] = None
    record_camera: Annotated[Path | None, Option("Record every frame of the camera: FILE.mcap.", "FILE")] = None
    pixels: Annotated[bool, Option("Draw the scene, and detect in it; needs --fast.", is_shown=False)] = False
    no_pictures: Annotated[bool, Option("Compute what the camera of a world sees, without pictures.", is_shown=False)] = False
    rig: str = "desk"
    name: Annotated[str | None, Option("Name of this head for --rig of gazerig ctl.", "NAME")] = None
    port: Annotated[str | None, Option("Serial port instead of the rig's.", "PORT")] = None
    bus: Annotated[str | None, Option("Substitute for servos: emulated or ideal.", "NAME")] = None
    rate: Annotated[float | None, Option("Rate of the loop instead of the rig's.", "HZ", 20.0, 1000.0, is_shown=False)] = None
    computer: Annotated[str | None, Option("Power of this computer: full, small, busy or least.", "LEVEL", is_shown=False)] = None
    seconds: Annotated[float | None, Option("Stop after S seconds.", "S", 0.0)] = None
    recover: Annotated[bool, Option("Move joints far outside their ranges inside, slowly.")] = False
    character: Annotated[str | None, Option("Character instead of the rig's, or none.", "NAME|FILE")] = None
    profile: Annotated[str | None, Option("Style of gaze: robot, mitake, nakamoto.", "NAME|FILE")] = None
    rules: Annotated[str | None, Option("Rules instead of the rig's: boxing ...", "NAME|FILE")] = None
    scanpath: Annotated[str | None, Option("Face scanpath: markov, simple, face_tracking, random.", "NAME", is_shown=False)] = None
    conversation: Annotated[str | None, Option("Initial state of a conversation: talk, listen, think.", "NAME", is_shown=False)] = None
    page: Annotated[str | None, Option("Address of the live page; 0.0.0.0:8080 serves others.", "HOST:PORT")] = None
    token_file: Annotated[Path | None, Option("File with the page's token; created if missing.", "FILE", is_shown=False)] = None
    no_page: Annotated[bool, Option("Do not serve the live page.")] = False
    no_browser: Annotated[bool, Option("Do not open the page in a browser.")] = False
    record: Annotated[Path | None, Option("Record every tick: FILE.mcap.", "FILE")] = None
    record_pictures: Annotated[float, Option("Camera frames per second in the recording.", "HZ", 0.0, 60.0, is_shown=False)] = 2.0
    summary: Annotated[str | None, Option("Write figures as JSON; - prints them.", "FILE")] = None
    force: Annotated[bool, Option("Overwrite existing files.")] = False
    # fmt: on

    @property
    def camera_source(self) -> str | None:
        """Return the name of the real or filmed camera, None for a scene."""
        if self.video is not None:
            return "a film"
        if self.camera is not None:
            return "a webcam" if isinstance(self.camera, int) else f"the camera {self.camera!r}"
        return "an OAK-D" if self.oak else None

    @property
    def world_name(self) -> str | None:
        """Return the name of the world without folder and ending, None without one."""
        return None if self.world is None else Path(self.world).stem

    @property
    def page_address(self) -> tuple[str, int] | None:
        """Return the address of the live page, None without one.

        Raises:
            SetupError: ``page`` is not an address.
        """
        if self.page is None:
            return None
        address = parse_host_port(self.page)
        return None if self.no_page or self.fast else address

    @property
    def page_token(self) -> str:
        """Return the token of the live page, "" for a new one.

        Raises:
            SetupError: ``token_file`` cannot be used.
        """
        if self.token_file is None or self.page_address is None:
            return ""
        return read_token(self.token_file)

    @property
    def output_files(self) -> tuple[Path, ...]:
        """Return the files whose names must be free before the run starts."""
        named = None if self.summary is None or self.summary == "-" else Path(self.summary)
        return tuple(path for path in (self.record, named) if path is not None)

    def check_and_complete(self, blind: bool = False) -> "RunOptions":
        """Return the options with the default scene if none was given.

        Args:
            blind: Whether no scene is needed.

        Raises:
            SetupError: they contradict each other.
        """
        _ = self.page_address, self.page_token
        views = [
            name
            for name in ("scene", "video", "camera", "oak", "world")
            # Webcam 0 is valid.
            if getattr(self, name) is not None and getattr(self, name) is not False
        ]
        scene = DEFAULT_SCENE if self.mock and not views and not blind else self.scene
        for is_broken, rule in self._rules(views, scene, blind):
            if is_broken:
                raise SetupError(rule)
        level = self.level
        bare = level is not None and level.pictures == "none" and self.world is not None
        return replace(self, scene=scene, no_pictures=self.no_pictures or bare)

    @property
    def level(self) -> LoadLevel | None:
        """Return the load level of the computer, None if it was not measured.

        Raises:
            SetupError: the level is unknown.
        """
        if self.computer is not None and self.computer not in LEVELS:
            raise SetupError(unknown_text("--computer", self.computer, LEVELS))
        return None if self.computer is None else LEVELS[self.computer]

    def _rules(
        self, views: Sequence[str], scene: str | None, blind: bool
    ) -> Iterator[tuple[bool, str]]:
        """Yield whether a rule is broken, and its text."""
        world, mock, bus = self.world is not None, self.mock, self.bus
        has_camera = self.camera is not None or self.oak
        yield self.fast and not mock, "--fast needs --mock: real servos need real time"
        yield (
            self.name is not None and not _NAME.fullmatch(self.name),
            f"--name {self.name}: a letter, then at most 31 of a-z A-Z 0-9 _ -",
        )
        yield (
            bus is not None and bus not in BUSES,
            unknown_text("--bus", str(bus), BUSES),
        )
        yield (
            bus is not None and not mock,
            f"--bus {bus} needs --mock: it selects the replacement of the rig's servos",
        )
        yield (
            len(views) > 1,
            f"{' and '.join(f'--{name}' for name in views)} exclude each other: "
            "the head looks at one of them",
        )
        yield (
            self.record_camera is not None and not has_camera,
            "--record-camera writes the frames of --oak or --camera: give one",
        )
        yield (
            not (views or blind or mock),
            "nothing to look at: give --oak, --camera N, --video FILE or --scene NAME",
        )
        yield (
            self.port is not None and mock,
            "--port and --mock exclude each other: --mock has its own port",
        )
        yield (
            self.fast and has_camera,
            "--fast needs a scene, a film or a recording: a camera runs in real time",
        )
        yield world and not mock, "--world needs --mock: real servos are in the real world"
        yield (
            world and bus == "ideal" and not self.fast,
            "--world with --bus ideal needs --fast: ideal servos have no real time",
        )
        yield (
            self.no_pictures and not world,
            "--no-pictures needs --world: pictures of a scene are drawn only with --pixels",
        )
        yield (
            self.pixels and scene is None,
            "--pixels draws a scene: it cannot be used with a world, a film or a camera",
        )
        yield (
            self.pixels and not self.fast,
            "a scene is drawn in simulated time only: add --fast, or use --world in real time",
        )
        yield (
            self.fast and self.seconds is None and scene is None and not world,
            "--fast needs --seconds S with a film: it would never end",
        )


def parse_host_port(text: str) -> tuple[str, int]:
    """Return host and port of HOST:PORT.

    Raises:
        SetupError: it is not an address.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise SetupError(f"--page {text}: not HOST:PORT, for example 127.0.0.1:8080")
    return host, int(port)


def parse_camera(text: str | None) -> int | str | None:
    """Return the value of --camera: the number of a webcam, or the name of a camera."""
    return int(text) if text is not None and text.isdecimal() else text
