"""The commands that calibrate a camera: the printed board, then lens and pose on the head."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from enum import StrEnum
from math import atan, degrees, radians
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.camera.capture_loop import CameraParts
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import FrameSource, Shot
from gazerig.drivers.camera.webcam import Webcam
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import SetupError, require_package
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.features.bringup.calibration.camera_calibration import (
    CameraCalibrationRefused,
    lens_params,
)
from gazerig.features.bringup.calibration.camera_procedure import (
    LensSteps,
    Neck,
    neck_angles,
    neck_steps,
)
from gazerig.features.bringup.calibration.charuco_views import RULER_MM, write_page
from gazerig.features.bringup.calibration.hand_eye import HandEye, HandEyeParams, camera_on_head
from gazerig.features.bringup.cli.manual_session import holding_rig
from gazerig.features.bringup.cli.ports import rig_ports
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson
from gazerig.features.bringup.cli.rig_writer import (
    AllYesOption,
    DryRunOption,
    OutOption,
    refuse_unwritable,
    show_and_write,
)
from gazerig.features.bringup.manual_control import JogParams, ManualControl
from gazerig.gaze.types import Angles3
from gazerig.robot.app.camera_factory import frame_orientation
from gazerig.robot.app.rig_limits import lid_ends, neck_span
from gazerig.robot.cli.terminal import (
    ForceOption,
    RigArgument,
    clear_errors,
    record_signals,
    say,
    status,
)
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.model.charuco_board import BoardParams, CharucoBoard
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.frames import CameraParams, LensParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens
from gazerig.robot.model.kinematics import NECK, Kinematics
from gazerig.sim_mock.cameras.charuco_scene import BOARD_LENS, BoardScene


class Paper(StrEnum):
    """Paper to print on; the keys of PAPERS_MM."""

    a4 = "a4"
    letter = "letter"


class CalibrationTarget(StrEnum):
    """Part of the camera to calibrate."""

    all = "all"
    lens = "lens"
    mount = "mount"


ColumnsOption = Annotated[int, typer.Option(min=3, max=20, help="Squares from left to right.")]
RowsOption = Annotated[int, typer.Option(min=3, max=20, help="Squares from top to bottom.")]
SquareOption = Annotated[float, typer.Option(metavar="MM", help="Side of a square.")]
_BOARD = BoardParams()


def calibrate_board(
    out: Annotated[Path, typer.Argument(help="File to write, .pdf or .png.")] = Path("board.pdf"),
    paper: Annotated[Paper, typer.Option(help="Paper, laid crosswise.")] = Paper.a4,
    columns: ColumnsOption = _BOARD.columns,
    rows: RowsOption = _BOARD.rows,
    square: SquareOption = _BOARD.square_mm,
    force: ForceOption = False,
) -> None:
    """Write the ChArUco board as a page to print at true size: gazerig calibrate board."""
    with clear_errors():
        write_page(CharucoBoard(_board(columns, rows, square, RULER_MM)), paper.value, out, force)
        say(f"{out}: print it at 100 % on {paper.value}, glue it on something flat and stiff,")
        say(f"and measure the ruler: if it is not {RULER_MM} mm, give --ruler when calibrating")


def calibrate_camera(
    rig: RigArgument = "desk",
    what: Annotated[
        CalibrationTarget, typer.Option(help="Calibrate the lens, its mount, or all.")
    ] = CalibrationTarget.all,
    camera: Annotated[int | None, typer.Option(min=0, help="Webcam N (default: 0).")] = None,
    oak: Annotated[
        bool, typer.Option("--oak", help="Use an OAK camera, whose frames have their lens.")
    ] = False,
    ruler: Annotated[
        float, typer.Option(metavar="MM", help="Measured length of the printed 100 mm ruler, mm.")
    ] = float(RULER_MM),
    columns: ColumnsOption = _BOARD.columns,
    rows: RowsOption = _BOARD.rows,
    square: SquareOption = _BOARD.square_mm,
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: AllYesOption = False,
    mock: Annotated[
        bool, typer.Option("--mock", help="Use emulated servos and a simulated board.")
    ] = False,
    port: Annotated[str | None, typer.Option(help="Serial port instead of the rig's.")] = None,
) -> None:
    """Measure the lens and the place of the camera, with the printed board."""
    with clear_errors(rig, port, mock), record_signals() as stopped:
        if oak and camera is not None:
            raise SetupError("--oak and --camera name two cameras: leave one away")
        if mock and oak:
            raise SetupError("--mock simulates a webcam: leave --oak away")
        if what is not CalibrationTarget.lens:
            require_package("scipy", "calibration")
        loaded = load_rig(rig)
        board = CharucoBoard(_board(columns, rows, square, ruler))
        if loaded.camera.mount != "head" and what is not CalibrationTarget.lens:
            raise SetupError(
                "camera.mount is base: the camera does not turn with the head, so looking from "
                "several neck angles shows nothing; use --what lens"
            )
        if not dry_run:
            refuse_unwritable(rig, out)
        job = _Job(
            loaded, board, stopped, Kinematics(loaded.geometry, loaded.joints, lid_ends(loaded))
        )
        source = OakSource(loaded.oak) if oak else Webcam(camera or 0, loaded.webcam)
        with _open_camera(job, None if mock else source) as eye:
            lens = _find_lens(job, eye, what)
            changes = lens.changes
            if what is not CalibrationTarget.lens:
                with moving_neck(loaded, eye.mock, port, stopped, yes) as neck:
                    found = _measure_mount(job, eye, neck, lens.camera, lens.good)
                    changes |= mount_changes(found, lens.camera)
        show_and_write(
            rig, loaded, changes, out, dry_run, TerminalPerson(Lines(None), stopped, yes)
        )


def mount_changes(found: HandEye, camera: CameraParams) -> dict[str, Any]:
    """Return a calibrated camera on the head as dotted keys of a rig file and values.

    They include the lens that belongs to this pose, at the image size of its measurement.
    """
    params, lens = found.camera_params(camera), found.lens
    place = ("position_mm", "yaw_deg", "pitch_deg", "roll_deg")
    return {f"camera.{key}": getattr(params, key) for key in place} | {
        "camera.lens.focal_px": (round(lens.fx_px, 2), round(lens.fy_px, 2)),
        "camera.lens.centre_px": (round(lens.cx_px, 2), round(lens.cy_px, 2)),
    }


class _Job(NamedTuple):
    """Values that all steps need."""

    rig: Rig
    board: CharucoBoard
    stopped: Callable[[], str | None]
    kinematics: Kinematics


class _KnownLens(NamedTuple):
    """The lens, as far as known.

    camera: camera with the lens; changes: values for the rig's file; good: its assumed quality
    """

    camera: CameraParams
    changes: dict[str, Any]
    good: HandEyeParams


class _CameraView(NamedTuple):
    """Source of frames, and the simulated camera behind it, if any."""

    look: Callable[[], Shot | None]
    now_s: Callable[[], float]
    rest: Callable[[float], None]
    mock: BoardScene | None


class _NullDetector:
    """Detector for a board, which has no faces."""

    def find(self, _: ImageArray) -> tuple[DetectedFace, ...]:
        """Find nothing."""
        return ()


@contextlib.contextmanager
def _open_camera(job: _Job, source: FrameSource | None) -> Iterator[_CameraView]:
    """Open the camera, or a simulated one."""
    clock = RealClock()
    if source is None:
        simulated = BoardScene(job.rig.camera, job.board, job.kinematics)
        yield _CameraView(
            lambda: simulated.look(clock.now_s()), clock.now_s, lambda _: None, simulated
        )
        return
    orientation = frame_orientation(job.rig.camera)
    parts = CameraParts(lambda: source, _NullDetector, orientation=orientation)
    camera = CameraWorker(parts, clock.now_s, in_thread=True)

    def look() -> Shot | None:
        found = camera.latest(clock.now_s())
        if found is None or found.image is None:
            return None
        return Shot(found.captured_s, found.number, found.image, lens=found.lens)

    camera.open()
    try:
        yield _CameraView(look, clock.now_s, lambda s: clock.sleep_until(clock.now_s() + s), None)
    finally:
        camera.close()


def _find_lens(job: _Job, eye: _CameraView, what: CalibrationTarget) -> _KnownLens:
    """Return the lens of the rig, or that of the camera's own frames, or measure it."""
    if what is CalibrationTarget.mount:
        return _KnownLens(job.rig.camera, {}, HandEyeParams())
    first = _first_frame(job, eye)
    if first.lens is not None:
        return _known_lens(job, first.lens, first.image)
    steps, number = LensSteps(job.board, radians(job.rig.camera.horizontal_field_deg)), 0
    say("hold the board before the camera and do what the line below says; Ctrl-C gives up")
    while True:
        raise_if_stopped(job.stopped)
        shot = eye.look()
        if shot is None or shot.number == number:
            eye.rest(0.01)
            continue
        number = shot.number
        step = steps.take(shot)
        lens, desired = None, step.coverage.missing[0] if step.coverage.missing else "enough"
        if step.coverage.enough and step.kept:
            lens, why = steps.try_result()
            desired = why or desired
        note = "kept" if step.kept else step.why
        status(f"{step.coverage.views} views, {step.corners} corners ({note}): {desired}")
        if lens is not None:
            break
    i = lens.intrinsics
    say(
        f"lens: {len(lens.kept)} views, {len(lens.dropped)} dropped, reprojection error "
        f"{lens.rms_px:.2f} px (worst view {max(lens.view_rms_px):.2f})"
    )
    say(
        f"focal length {i.fx_px:.1f} +-{lens.focal_std_px[0]:.1f}, "
        f"{i.fy_px:.1f} +-{lens.focal_std_px[1]:.1f} px; axis at {i.cx_px:.1f} "
        f"+-{lens.centre_std_px[0]:.1f}, {i.cy_px:.1f} +-{lens.centre_std_px[1]:.1f} px"
    )
    if eye.mock is not None:
        t = BOARD_LENS
        say(f"true: {t.fx_px:.1f}, {t.fy_px:.1f} px; axis at {t.cx_px:.1f}, {t.cy_px:.1f} px")
    camera = replace(job.rig.camera, lens=lens.params())
    focal = max(lens.focal_std_px) / i.fx_px * 100.0
    centre = max(lens.centre_std_px) * 640.0 / lens.width_px
    good = HandEyeParams(lens_error_percent=max(focal, 0.02), centre_error_px=max(centre, 0.1))
    return _KnownLens(camera, lens_keys(lens.params(), lens.horizontal_field_deg), good)


def _known_lens(job: _Job, lens: Intrinsics, image: ImageArray) -> _KnownLens:
    """Return the lens that an OAK camera gives with its frames, from its factory calibration."""
    height, width = image.shape[:2]
    longer, axis, focal = (
        (width, lens.cx_px, lens.fx_px) if width >= height else (height, lens.cy_px, lens.fy_px)
    )
    left, right = (axis + 0.5) / focal, (longer - 0.5 - axis) / focal
    params = lens_params(lens, width, height)
    say(
        f"the camera's own lens: focal length {lens.fx_px:.1f}, {lens.fy_px:.1f} px, axis at "
        f"{lens.cx_px:.1f}, {lens.cy_px:.1f} px of {width} x {height}"
    )
    changes = lens_keys(params, degrees(atan(left) + atan(right)))
    return _KnownLens(replace(job.rig.camera, lens=params), changes, HandEyeParams())


def lens_keys(lens: LensParams, horizontal_field_deg: float) -> dict[str, Any]:
    """Return a lens as dotted keys of a rig file and values."""
    keys = {f"camera.lens.{key}": value for key, value in asdict(lens).items()}
    return {"camera.horizontal_field_deg": round(horizontal_field_deg, 2), **keys}


def _measure_mount(
    job: _Job, eye: _CameraView, neck: Neck, camera: CameraParams, good: HandEyeParams
) -> HandEye:
    """Observe the hanging board from several neck angles."""
    if camera.lens is None:
        raise SetupError("the lens is not measured yet: calibrate it first (--what lens or all)")
    shot = _first_frame(job, eye)
    height, width = shot.image.shape[:2]
    if camera.lens.size_px != (width, height):
        wide, high = camera.lens.size_px
        raise SetupError(
            f"frames are {width} x {height}, the lens was measured on {wide} x {high}: calibrate it "
            "again (--what all)"
        )
    lens = intrinsics_of_lens(camera.lens, radians(camera.horizontal_field_deg), width, height)
    yaw, pitch, roll = (neck_span(job.rig, name) for name in NECK)
    planned = neck_angles((yaw, pitch, roll), lens, width, height)
    views = []
    for step in neck_steps(neck, eye.look, eye.now_s, job.board, job.kinematics, planned):
        yaw_deg, pitch_deg, roll_deg = map(degrees, step.asked_rad)
        what = f"{step.corners} corners" if step.view is not None else step.why
        say(
            f"{step.number}/{step.step_count}: yaw {yaw_deg:+.0f}, pitch {pitch_deg:+.0f}, "
            f"roll {roll_deg:+.0f}: {what}"
        )
        if step.view is not None:
            views.append(step.view)
    found = camera_on_head(views, lens, width, good)
    say(
        f"mount: {len(found.kept)} views, {len(found.dropped)} dropped, reprojection error "
        f"{found.rms_px:.2f} px, {found.corner_px:.2f} px with neck joints off by "
        f"{found.joint_error_deg:.2f} deg"
    )
    mm, deg = found.position_std_mm, found.angle_std_deg
    say(f"sure to {mm[0]:.1f}, {mm[1]:.1f}, {mm[2]:.1f} mm and {max(deg):.2f} deg")
    if eye.mock is not None:
        t = eye.mock.mount
        at = ", ".join(f"{mm:.1f}" for mm in t.position_mm)
        say(f"true: {at} mm, yaw {t.yaw_deg:.2f}, pitch {t.pitch_deg:.2f}, roll {t.roll_deg:.2f}")
    return found


def _first_frame(job: _Job, eye: _CameraView) -> Shot:
    """Wait for a frame."""
    give_up_s = eye.now_s() + 5.0
    while eye.now_s() < give_up_s:
        raise_if_stopped(job.stopped)
        shot = eye.look()
        if shot is not None:
            return shot
        eye.rest(0.02)
    raise SetupError("the camera gives no frames: check its cable, or name another (--camera N)")


def _board(columns: int, rows: int, square_mm: float, ruler_mm: float) -> BoardParams:
    """Return the board with its printed size."""
    marker_mm = square_mm * _BOARD.marker_mm / _BOARD.square_mm
    try:
        return BoardParams(columns, rows, square_mm, marker_mm).scaled(ruler_mm / RULER_MM)
    except ValueError as error:
        raise SetupError(f"this board cannot be: {error}") from error


StopReason = Callable[[], str | None]
"""Returns why to stop, None without a reason."""

_GENTLE_DEG_S = 15.0
_SETTLE_S = 0.4


class JoggedNeck:
    """``calibration.camera_procedure.Neck`` that moves through the guard, like jogging."""

    def __init__(
        self, control: ManualControl, mock: BoardScene | None, stopped: StopReason
    ) -> None:
        self._control, self._mock, self._stopped = control, mock, stopped
        self._angles: Angles3 = (0.0, 0.0, 0.0)

    def turn(self, head_rad: Angles3) -> None:
        """Move gently; if the guard limits the motion, the measured angles are used."""
        raise_if_stopped(self._stopped)
        there = self._control.body.names
        axes = zip(NECK, head_rad, strict=True)
        goal = {name: degrees(a) for name, a in axes if name in there}
        moved = self._control.pose(goal)
        if moved.end_reason == "torque_off":
            raise SetupError(
                "the torque went off during the move: see gazerig doctor, then start again"
            )
        self.rest(_SETTLE_S)

    def rest(self, seconds: float) -> None:
        """Hold still, and measure the head."""
        moved = self._control.hold(seconds)
        raise_if_stopped(self._stopped)
        at = dict(zip(self._control.body.names, moved.last.joints.position_rad, strict=True))
        self._angles = (at.get(NECK[0], 0.0), at.get(NECK[1], 0.0), at.get(NECK[2], 0.0))
        if self._mock is not None:
            self._mock.head_rad = self._angles

    def angles(self) -> Angles3:
        """Return yaw, pitch and roll as last measured."""
        return self._angles


@contextlib.contextmanager
def moving_neck(
    rig: Rig, mock: BoardScene | None, port: str | None, stopped: StopReason, yes: bool
) -> Iterator[JoggedNeck]:
    """Return a neck that moves gently; in all cases it ends with the torque off.

    mock: the simulated board, for which the servos are also emulated

    Raises:
        SetupError: port or servos do not match the configuration, or the answer was no.
    """
    if any(name not in rig.joints for name in NECK[:2]):
        raise CameraCalibrationRefused(
            "the camera's place is found by turning the neck left, right, up and down, and "
            "this rig's does not: measure its place and write it into camera.position_mm"
        )
    say("hang the board upright, 0.5 to 1 m before the head, where it cannot move; the head")
    say("will look at it from several sides: keep your fingers away; Ctrl-C stops it")
    if mock is not None:
        mock.head_rad = (0.0, 0.0, 0.0)
    elif not TerminalPerson(Lines(None), stopped, yes).agrees(
        "does the board hang, and is the head free to move?"
    ):
        raise CameraCalibrationRefused("left out as you asked: nothing was written")
    params = JogParams(speed_deg_s=_GENTLE_DEG_S)
    with (
        rig_ports(rig, mock is not None, port) as wire,
        holding_rig(rig, wire.paths, params, stopped, Interrupts.from_stop(stopped)) as control,
    ):
        neck = JoggedNeck(control, mock, stopped)
        neck.rest(0.1)
        yield neck


def raise_if_stopped(stopped: StopReason) -> None:
    """Refuse to continue if there is a reason to stop.

    Raises:
        CameraCalibrationRefused: the message has the reason.
    """
    why = stopped()
    if why is not None:
        raise CameraCalibrationRefused(f"stopped by {why}: nothing was written")
