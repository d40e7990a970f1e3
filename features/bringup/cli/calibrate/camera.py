"""The commands that calibrate a camera: the printed board, then lens and pose on the head."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from enum import StrEnum
from functools import partial
from math import degrees, radians
from pathlib import Path
from typing import Annotated, Any, Self

import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.camera.capture_loop import CameraParts
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.orientation import FrameOrientation
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.camera.source import FrameSource, Shot
from gazerig.drivers.camera.webcam import Webcam
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import SetupError, require_package
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.charuco_board import CharucoBoard
from gazerig.features.bringup.calibration.board_page import RULER_MM, write_page
from gazerig.features.bringup.calibration.board_views import MOST_VIEWS, ViewCollector
from gazerig.features.bringup.calibration.camera_procedure import (
    JoggedNeck,
    neck_angles,
    neck_steps,
)
from gazerig.features.bringup.calibration.hand_eye import HandEye, camera_on_head
from gazerig.features.bringup.calibration.lens_calibration import (
    CameraCalibrationRefused,
    LensCalibration,
    calibrate_lens,
    field_deg,
    lens_params,
)
from gazerig.features.bringup.cli.motion import holding_rig
from gazerig.features.bringup.cli.ports import MockOption, YesOption, rig_ports
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson
from gazerig.features.bringup.cli.rig_writer import (
    DryRunOption,
    OutOption,
    refuse_unwritable,
    write_values,
)
from gazerig.robot.cli.terminal import (
    ForceOption,
    RigArgument,
    clear_errors,
    record_signals,
    say,
    status,
)
from gazerig.robot.loop.power_down import Interrupts
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.frames import CameraParams
from gazerig.robot.model.intrinsics import intrinsics_of_lens
from gazerig.robot.model.kinematics import NECK, Kinematics
from gazerig.robot.run.rig_limits import lid_ends, neck_span
from gazerig.sim_mock.cameras.charuco_scene import BoardScene

_GENTLE_DEG_S = 15.0
_FIRST_FRAME_S = 5.0


class Paper(StrEnum):
    """Paper to print on; the keys of PAPERS_MM."""

    a4 = "a4"
    letter = "letter"


class CalibrationTarget(StrEnum):
    """Part of the camera to calibrate."""

    all = "all"
    lens = "lens"
    mount = "mount"


def calibrate_board(
    out: Annotated[Path, typer.Argument(help="File to write, .pdf or .png.")] = Path("board.pdf"),
    paper: Annotated[Paper, typer.Option(help="Paper, laid crosswise.")] = Paper.a4,
    force: ForceOption = False,
) -> None:
    """Write the ChArUco board as a page to print at true size: gazerig calibrate board."""
    with clear_errors():
        write_page(CharucoBoard(), paper.value, out, force)
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
        float,
        typer.Option(metavar="MM", min=20, max=500, help="Length of the printed 100 mm ruler."),
    ] = float(RULER_MM),
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    mock: MockOption = False,
    port: Annotated[str | None, typer.Option(help="Serial port instead of the rig's.")] = None,
) -> None:
    """Measure the lens and the place of the camera, with the printed board."""
    with clear_errors(rig, port, mock), record_signals() as stopped:
        if oak and camera is not None:
            raise SetupError("--oak and --camera name two cameras: leave one away")
        if mock and oak:
            raise SetupError("--mock simulates a webcam: leave --oak away")
        loaded, moves = load_rig(rig), what is not CalibrationTarget.lens
        if moves:
            require_package("scipy", "calibration")
            _refuse_fixed(loaded)
        if not dry_run:
            refuse_unwritable(rig, out)
        board = CharucoBoard(ruler / RULER_MM)
        person = TerminalPerson(Lines(None), stopped, yes)
        source = OakSource(loaded.oak) if oak else Webcam(camera or 0, loaded.webcam)
        with _Eye(loaded, board, None if mock else source, stopped) as eye:
            seen, changes = loaded.camera, dict[str, Any]()
            if what is not CalibrationTarget.mount:
                seen, changes = _find_lens(loaded, eye)
            if moves:
                found = _measure_mount(loaded, eye, seen, port, person)
                changes |= mount_changes(found, seen)
        write_values(rig, changes, out, person, dry_run)


def _refuse_fixed(rig: Rig) -> None:
    """Refuse a camera that the neck does not turn."""
    if rig.camera.mount != "head":
        raise SetupError(
            "camera.mount is base: the camera does not turn with the head, so looking from "
            "several neck angles shows nothing; use --what lens"
        )
    if any(name not in rig.joints for name in NECK[:2]):
        raise CameraCalibrationRefused(
            "the camera's place is found by turning the neck left, right, up and down, and "
            "this rig's does not: measure its place and write it into camera.position_mm"
        )


def mount_changes(found: HandEye, camera: CameraParams) -> dict[str, Any]:
    """Return a calibrated camera on the head as dotted keys of a rig file and values.

    They include the lens that belongs to this pose, at the image size of its measurement.
    """
    params, lens = found.camera_params(camera), found.lens
    return {
        "camera.position_mm": tuple(round(mm, 1) for mm in params.position_mm),
        "camera.yaw_deg": round(params.yaw_deg, 2),
        "camera.pitch_deg": round(params.pitch_deg, 2),
        "camera.roll_deg": round(params.roll_deg, 2),
        "camera.lens.focal_px": (round(lens.fx_px, 2), round(lens.fy_px, 2)),
        "camera.lens.centre_px": (round(lens.cx_px, 2), round(lens.cy_px, 2)),
    }


class _NullDetector:
    """Detector for a board, which has no faces."""

    def find(self, _: ImageArray) -> tuple[DetectedFace, ...]:
        return ()


class _Eye(contextlib.ExitStack):
    """Frames of the camera within the block; of a simulated one without a source."""

    def __init__(
        self,
        rig: Rig,
        board: CharucoBoard,
        source: FrameSource | None,
        stopped: Callable[[], str | None],
    ) -> None:
        super().__init__()
        self.board, self.stopped, self._last = board, stopped, 0
        self.kinematics = Kinematics(rig.geometry, rig.joints, lid_ends(rig))
        self.clock = RealClock()
        self.scene = BoardScene(rig.camera, board, self.kinematics) if source is None else None
        self._worker: CameraWorker | None = None
        if source is not None:
            orientation = FrameOrientation(rig.camera.rotation, rig.camera.mirrored)
            parts = CameraParts(lambda: source, _NullDetector, orientation=orientation)
            self._worker = CameraWorker(parts, self.clock.now_s, in_thread=True)

    def __enter__(self) -> Self:
        """Open the camera."""
        if self._worker is not None:
            self._worker.open()
            self.callback(self._worker.close)
        return self

    def look(self) -> Shot | None:
        """Return the newest frame immediately, None before the first."""
        now_s = self.clock.now_s()
        if self.scene is not None:
            return self.scene.look(now_s)
        found = None if self._worker is None else self._worker.latest(now_s)
        if found is None or found.image is None:
            return None
        return Shot(found.captured_s, found.number, found.image, lens=found.lens)

    def next(self) -> Shot:
        """Wait for a new frame."""
        end_s = self.clock.now_s() + _FIRST_FRAME_S
        while (shot := self.look()) is None or shot.number == self._last:
            self.raise_if_stopped()
            if self.clock.now_s() > end_s:
                raise SetupError(
                    "the camera gives no frames: check its cable, or name another (--camera N)"
                )
            self.clock.sleep_until(self.clock.now_s() + 0.01)
        self.raise_if_stopped()
        self._last = shot.number
        return shot

    def raise_if_stopped(self) -> None:
        """Refuse to continue if there is a reason to stop."""
        why = self.stopped()
        if why is not None:
            raise CameraCalibrationRefused(f"stopped by {why}: nothing was written")


def _find_lens(rig: Rig, eye: _Eye) -> tuple[CameraParams, dict[str, Any]]:
    """Return the camera with its lens, from its own frames or measured, and the keys to write."""
    first = eye.next()
    height, width = first.image.shape[:2]
    if (lens := first.lens) is not None:
        say(
            f"the camera's own lens: focal length {lens.fx_px:.1f}, {lens.fy_px:.1f} px, axis at "
            f"{lens.cx_px:.1f}, {lens.cy_px:.1f} px of {width} x {height}"
        )
    else:
        found = _measure_lens(rig, eye, width, height)
        lens, (fx, fy, cx, cy) = found.intrinsics, found.std_px
        say(
            f"lens: {len(found.view_rms_px)} views, {found.dropped} dropped, reprojection error "
            f"{found.rms_px:.2f} px (worst view {max(found.view_rms_px):.2f})"
        )
        say(
            f"focal length {lens.fx_px:.1f} +-{fx:.1f}, {lens.fy_px:.1f} +-{fy:.1f} px; axis at "
            f"{lens.cx_px:.1f} +-{cx:.1f}, {lens.cy_px:.1f} +-{cy:.1f} px"
        )
    params = lens_params(lens, width, height)
    keys = {f"camera.lens.{key}": value for key, value in asdict(params).items()}
    keys["camera.horizontal_field_deg"] = round(field_deg(lens, width, height), 2)
    return replace(rig.camera, lens=params), keys


def _measure_lens(rig: Rig, eye: _Eye, width: int, height: int) -> LensCalibration:
    """Collect views of a board in a person's hands until they determine the lens."""
    guess = intrinsics_of_view(radians(rig.camera.horizontal_field_deg), width, height)
    collector = ViewCollector(guess, width, height)
    say("hold the board before the camera and do what the line below says; Ctrl-C gives up")
    while True:
        image = eye.next().image
        if image.shape[:2] != (height, width):
            raise SetupError("the size of the camera's frames has changed: start again")
        why = collector.offer(eye.board.find(image))
        desired = collector.missing
        if not desired and not why:
            try:
                return calibrate_lens(collector.views, width, height)
            except CameraCalibrationRefused as refused:
                if len(collector.views) >= MOST_VIEWS:
                    raise
                desired = str(refused)
        status(f"{len(collector.views)} views ({why or 'kept'}): {desired}")


def _measure_mount(
    rig: Rig, eye: _Eye, camera: CameraParams, port: str | None, person: TerminalPerson
) -> HandEye:
    """Observe the hanging board from several neck angles."""
    height, width = eye.next().image.shape[:2]
    if camera.lens is None or camera.lens.size_px != (width, height):
        raise SetupError(f"the lens is not measured on {width} x {height} frames: use --what all")
    lens = intrinsics_of_lens(camera.lens, radians(camera.horizontal_field_deg), width, height)
    planned = neck_angles([neck_span(rig, name) for name in NECK], lens, width, height)
    views = []
    with _moving_neck(rig, eye, port, person) as neck:
        steps = neck_steps(neck, eye.look, eye.clock.now_s, eye.board, eye.kinematics, planned)
        for number, step in enumerate(steps, 1):
            eye.raise_if_stopped()
            angles = ", ".join(f"{degrees(angle):+.0f}" for angle in step.asked_rad)
            found = step.why if step.view is None else f"{len(step.view.seen.ids)} corners"
            say(f"{number}/{len(planned)}: yaw, pitch, roll {angles}: {found}")
            views += [step.view] if step.view is not None else []
    result = camera_on_head(views, lens, width)
    x, y, z = result.position_std_mm
    say(
        f"mount: {len(views)} views, reprojection error {result.rms_px:.2f} px, neck joints off by "
        f"{result.joint_error_deg:.2f} deg; sure to {x:.1f}, {y:.1f}, {z:.1f} mm and "
        f"{max(result.angle_std_deg):.2f} deg"
    )
    return result


@contextlib.contextmanager
def _moving_neck(
    rig: Rig, eye: _Eye, port: str | None, person: TerminalPerson
) -> Iterator[JoggedNeck]:
    """Return a neck that moves gently; in all cases it ends with the torque off.

    Raises:
        SetupError: port or servos do not match the configuration, or the answer was no.
    """
    say("hang the board upright, 0.5 to 1 m before the head, where it cannot move; the head")
    say("will look at it from several sides: keep your fingers away; Ctrl-C stops it")
    mock, stopped = eye.scene is not None, eye.stopped
    if not mock and not person.agrees("does the board hang, and is the head free to move?"):
        raise CameraCalibrationRefused("left out as you asked: nothing was written")
    interrupts = Interrupts.from_stop(stopped)
    with (
        rig_ports(rig, mock, port) as wire,
        holding_rig(rig, wire.paths, _GENTLE_DEG_S, stopped, interrupts) as control,
    ):
        watch = partial(setattr, eye.scene, "head_rad") if mock else None
        neck = JoggedNeck(control, watch)
        neck.rest(0.1)
        yield neck
