"""Options of one run: one value from the command line to the assembly."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
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


@dataclass(frozen=True)
class RunOptions:
    """Options of a run: rig, scene, observers and outputs; None if not given.

    Attributes:
        mock: emulated servos instead of the rig's.
        fast: simulated time.
        seed: Seed of all random generators.
        scene, video, camera, oak, replay, world: source of the view; one of them; a camera is the
            number of a webcam or the name of another package's camera.
        world: a world with physics, by name or path; its camera's images are rendered and analysed
            by the real detectors.
        no_pictures: a world is not rendered: detections are computed, as for a scene.
        pixels: the scene is drawn and analysed by the real detectors.
        scanpath, saccade: models instead of the rig's; rules: a rule set instead of the rig's.
        port: serial port instead of the rig's.
        rig, character, profile: names or paths; name: name of this head for other programs.
        behaviour, conversation: initial choices.
        seconds: duration of the run.
        page: HOST:PORT of the live page; no_page: without it; token_file: file with its token, None
            for a new token.
        record: file to record to; record_pictures: camera frames per second in it.
        force: overwrite older files.
        recover: move joints that are far outside their ranges inside, instead of refusing to start.
        no_browser: leave opening the page to the user.
        verbose: also print details.
        summary: file of the figures, "-" for standard output.
        bus: replacement of the servos, "emulated" (byte-true, the default) or "ideal" (a lag).
        rate: rate of the loop, Hz, instead of the rig's.
        computer: power of the computer, a level of ``LEVELS``.
    """

    mock: bool = False
    fast: bool = False
    seed: int = 0
    scene: str | None = None
    video: Path | None = None
    camera: int | str | None = None
    oak: bool = False
    replay: Path | None = None
    record_camera: Path | None = None
    world: str | None = None
    no_pictures: bool = False
    pixels: bool = False
    scanpath: str | None = None
    saccade: str | None = None
    rules: str | None = None
    port: str | None = None
    rig: str = "desk"
    character: str | None = None
    profile: str | None = None
    behaviour: str | None = None
    conversation: str | None = None
    seconds: float | None = None
    page: str | None = None
    no_page: bool = False
    token_file: Path | None = None
    record: Path | None = None
    record_pictures: float = 2.0
    force: bool = False
    recover: bool = False
    no_browser: bool = False
    verbose: bool = False
    summary: str | None = None
    bus: str | None = None
    name: str | None = None
    rate: float | None = None
    computer: str | None = None

    @property
    def camera_source(self) -> str | None:
        """Return the name of the real or filmed camera, None for a scene."""
        if self.video is not None:
            return "a film"
        if self.replay is not None:
            return "a recording"
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
            for name in ("scene", "video", "camera", "oak", "replay", "world")
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
            raise SetupError(f"--computer {self.computer}: unknown; available: {', '.join(LEVELS)}")
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
            f"--bus {bus}: unknown; available: {', '.join(BUSES)}",
        )
        yield (
            bus is not None and self.port is not None,
            f"--bus {bus} and --port exclude each other: servos at a port are real",
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
            world and self.pixels,
            "--world and --pixels exclude each other: a world is rendered in any case",
        )
        yield (
            self.no_pictures and not world,
            "--no-pictures needs --world: pictures of a scene are drawn only with --pixels",
        )
        yield (
            self.pixels and scene is None,
            "--pixels draws a scene: it cannot be used with a film or a camera",
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
