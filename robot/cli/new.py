"""Command new: a new rig's file, the shortest working one."""

from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Annotated, Literal, NamedTuple

import msgspec
import typer
from msgspec import Struct

from gazerig.config.faults import ConfigError
from gazerig.config.save import format_value
from gazerig.drivers.errors import SetupError, install_command
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.params import unknown_text
from gazerig.robot.cli.rig_files import good_text
from gazerig.robot.cli.terminal import ForceOption, clear_errors, say

app = typer.Typer()

_BOARD, _JOINTS, _CAMERA = "none", "eyes-lids", "webcam"
"""Defaults of the options."""


class _Drive(Struct, frozen=True):
    """Servo of a joint, as parts of the joint's line."""

    model: str
    limits: str
    more: str


class _Board(Struct, frozen=True):
    """Board of servos.

    port: its usual port; first_id: usual first id of its servos; tilt_deg: limit of an eye's tilt
    eye, lid, neck: drives of the joints; gaze: settings for servos slower than the fastest ones
    """

    summary: str
    port: str
    kind: str
    first_id: int
    id_comment: str
    tilt_deg: int
    eye: _Drive
    lid: _Drive
    neck: _Drive
    gaze: tuple[str, ...]


class Mechanism(Struct, frozen=True):
    """A common mechanism: its description, and its joints, one servo each."""

    summary: str
    joints: tuple[str, ...]


class _Joint(Struct, frozen=True):
    """Usual joint: its drive and range; of a lid also the angles shut and open.

    mirrored: whether its servo is mounted mirrored to that on the left
    """

    drive: Literal["eye", "lid", "neck"] = "neck"
    low_deg: int = -30
    high_deg: int = 30
    ends_deg: tuple[int, int] = (0, 0)
    mirrored: bool = False


class _Tables(Struct, frozen=True):
    boards: dict[str, _Board]
    cameras: dict[str, str]
    mechanisms: dict[str, Mechanism]
    joints: dict[str, _Joint]


_TABLES = msgspec.json.decode(Path(__file__).with_name("new_rigs.json").read_bytes(), type=_Tables)
BOARDS = {name: board.summary for name, board in _TABLES.boards.items()}
"""Boards of servos, with their descriptions."""
CAMERAS = _TABLES.cameras
"""Cameras, with their descriptions."""
MECHANISMS = _TABLES.mechanisms
"""Mechanisms by the name for ``gazerig new --joints``, which also accepts names of joints."""
_NECKLESS_GAZE = "idle: {reach_deg: 28}"
"""Idle gaze without a neck goes no farther than the eyes alone can turn."""


class NewRig(NamedTuple):
    """The rig to write.

    board, camera: keys of BOARDS and CAMERAS
    joints: names, in the order of their ids
    """

    name: str
    board: str
    joints: tuple[str, ...]
    camera: str

    @property
    def has_neck(self) -> bool:
        """Return whether a neck turns the head."""
        return any(name.startswith("neck_") for name in self.joints)


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help="The YAML file to write.")] = Path("myrig.yaml"),
    board: Annotated[
        str | None,
        typer.Option(help=f"{', '.join(BOARDS)}."),
    ] = None,
    joints: Annotated[
        str | None,
        typer.Option(
            help=f"{', '.join(MECHANISMS)}; or names of joints: eyes_pan,eyes_tilt,jaw.",
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(help=f"{', '.join(CAMERAS)}."),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a new rig's YAML, check it, and print the next command."""
    with clear_errors():
        if file.suffix not in (".yaml", ".yml"):
            raise SetupError(f"{file}: a rig's file ends in .yaml: gazerig new {file.stem}.yaml")
        refuse_existing(file, force=force)
        mechanisms = {name: one.summary for name, one in MECHANISMS.items()}
        wanted = joints or _usual("joints", mechanisms, _JOINTS)
        rig = NewRig(
            file.stem,
            _choice("board", board, BOARDS, _BOARD),
            joints_of(wanted),
            _choice("camera", camera, CAMERAS, _CAMERA),
        )
        from gazerig.config.schema import load_rig

        write_file(file, rig_text(rig), force)
        try:
            say(good_text(str(file), load_rig(str(file))))
        except ConfigError:  # an invalid file is deleted
            file.unlink()
            raise
        for line in next_steps(rig, str(file)):
            print(line)


def _choice(option: str, given: str | None, choices: Mapping[str, str], usual: str) -> str:
    """Return the value of an option, or its default.

    Raises:
        SetupError: the value is unknown.
    """
    if given is not None and given not in choices:
        raise SetupError(unknown_text(f"--{option}", given, choices))
    return given or _usual(option, choices, usual)


def _usual(option: str, choices: Mapping[str, str], usual: str) -> str:
    """Return the default of an option, and print its choices."""
    say(f"{option}: {usual}; --{option} NAME chooses another one:")
    for name, summary in choices.items():
        say(f"  {name:10} {summary}")
    return usual


def next_steps(rig: NewRig, file: str) -> Iterable[str]:
    """Return the next commands for a new rig file, as lines."""
    named = quote(file)
    sees = {"webcam": "--camera 0", "oak": "--oak", "none": "--scene visitor"}[rig.camera]
    steps = [(f"gazerig run {named} --mock", "the head in your browser, without any hardware")]
    if rig.board != "none":
        if rig.board not in ("maestro", "pca9685"):  # whose channels have no ids
            steps.append((f"gazerig setup {named}", "with the adaptor plugged in: gives ids"))
        steps += [
            (f"gazerig doctor {named} --fix", "check port, servos and settings against the file"),
            (f"gazerig calibrate {named}", "measure zero, sign and range of each joint"),
            (f"gazerig run {named} {sees}", "the real head"),
        ]
    wide = max(len(command) for command, _ in steps)
    yield "next:"
    yield from (f"  {command:{wide}}  {what}" for command, what in steps)
    if rig.camera == "oak" and find_spec("depthai") is None:
        yield f"an OAK-D needs one more package: {install_command('oak')}"


def rig_text(new: NewRig) -> str:
    """Return the YAML of a rig.

    Raises:
        KeyError: there is no such board or camera.
    """
    return "".join(f"{line}\n" for line in _lines(new, _TABLES.boards[new.board]))


def joints_of(text: str) -> tuple[str, ...]:
    """Return the joints of a mechanism's name, or of joint names separated by commas."""
    if text in MECHANISMS:
        return MECHANISMS[text].joints
    return tuple(name for word in text.split(",") if (name := word.strip()))


def _lines(new: NewRig, board: _Board) -> Iterator[str]:
    usual = {name: _TABLES.joints.get(name, _Joint()) for name in new.joints}
    there = "no board yet: only with --mock" if new.board == "none" else "`gazerig scan` lists it"
    yield f"# A head of {len(new.joints)} servos. The shipped rig desk.yaml explains the keys."
    yield f"name: {format_value(new.name)}"
    yield "profile: robot"
    port = format_value(board.port)
    yield f"bus: {{kind: {board.kind}, port: {port}}}  # port: {there}"
    yield "# Measure in mm: the eyes' centres ahead of and above the neck's pitch axis (or the table)."
    height, ahead, above = (70, 38, 55) if new.has_neck else (0, 0, 90)
    yield "geometry:"
    yield (
        f"  {{pitch_axis_height_mm: {height}, eyes_ahead_mm: {ahead}, eyes_above_mm: {above}, "
        "interocular_mm: 62}"
    )
    yield f"joints:  # id: {board.id_comment}; `gazerig calibrate` measures zero, sign and range of each"
    for number, (name, joint) in enumerate(usual.items(), board.first_id):
        drive: _Drive = getattr(board, joint.drive)
        low, high = joint.low_deg, joint.high_deg
        if name.endswith("_tilt"):
            low, high = -board.tilt_deg, board.tilt_deg
        sign = "sign: -1, " if joint.mirrored else ""
        yield (
            f"  {name}: {{id: {number}, model: {drive.model}, min_deg: {low}, max_deg: {high}, "
            f"{drive.limits}, {sign}{drive.more}}}"
        )
    lids = {name: joint.ends_deg for name, joint in usual.items() if joint.drive == "lid"}
    if lids:
        yield "lid_joints:  # each lid shut and fully open"
        for name, (shut, wide) in lids.items():
            yield f"  {name.removesuffix('_lid').removesuffix('_upper')}_deg: [{shut}, {wide}]"
    park = ["neck_pitch: -12"] if "neck_pitch" in usual else []
    park += [f"{name}: {shut}" for name, (shut, _) in lids.items()]
    if park:
        yield f"park_deg: {{{', '.join(park)}}}"
    yield from _camera_lines(new)
    gaze = [*board.gaze, *([] if "neck_yaw" in usual else [_NECKLESS_GAZE])]
    if gaze:
        yield "gaze:  # differences from a head with a neck and fast servos"
        yield from (f"  {line}" for line in gaze)


def _camera_lines(new: NewRig) -> Iterator[str]:
    """Return the mount of the camera: on the head if a neck turns it, otherwise next to it."""
    if new.camera == "none":
        return
    mount, place, origin = "base", "[10, 0, 140]", "the point on the table below the eyes"
    if new.has_neck:
        mount, place, origin = "head", "[20, 0, 45]", "the point between the eyes"
    field = 69 if new.camera == "oak" else 60
    yield f"# position_mm: the lens ahead, left and above of {origin}."
    yield f"camera: {{mount: {mount}, position_mm: {place}, horizontal_field_deg: {field}}}"
