"""Calibration of a camera, step by step, from frames to the next instruction and the result.

Nothing here prints or waits: the caller of the steps shows them, supplies the frames and moves the
head.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import atan, degrees, radians
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError
from gazerig.features.bringup.calibration.camera_calibration import (
    CameraCalibrationRefused,
    LensCalibration,
    LensCalibrationParams,
    calibrate_lens,
)
from gazerig.features.bringup.calibration.charuco_views import Coverage, ViewCollector
from gazerig.features.bringup.calibration.hand_eye import NeckView
from gazerig.gaze.types import Angles2, Angles3, HeadGeometry
from gazerig.params import Bounds
from gazerig.robot.model.charuco_board import LEAST_CORNERS, CharucoBoard, DetectedBoard

Look = Callable[[], Shot | None]
"""Returns the newest frame immediately, None before the first."""

# Fractions of the neck's range (yaw, pitch, roll): combinations of two axes, symmetric.
_PATTERN = (
    (0.0, 0.0, 0.0), (0.5, 0.5, 1.0), (1.0, 0.0, 0.0), (1.0, 0.0, -1.0), (0.9, 0.8, 0.0),
    (0.0, 1.0, 0.0), (-0.5, 0.5, -1.0), (-0.9, 0.8, 0.0), (-1.0, 0.0, 0.0), (-1.0, 0.0, 1.0),
    (-0.9, -0.8, 0.0), (-0.5, -0.5, 1.0), (0.0, -1.0, 0.0), (0.5, -0.5, -1.0), (0.9, -0.8, 0.0),
    (0.0, 0.0, 1.0), (0.0, 0.0, -1.0),
)  # fmt: skip


@dataclass(frozen=True)
class NeckStepParams:
    """Neck angles and frames of the views of the board."""

    # fmt: off
    yaw_deg: Annotated[float, Bounds(2, 60), "farthest to each side"] = 18.0
    pitch_deg: Annotated[float, Bounds(2, 60), "farthest up and down"] = 11.0
    roll_deg: Annotated[float, Bounds(0, 60), "farthest roll to each side"] = 12.0
    frames: Annotated[int, Bounds(1, 50), "frames averaged at each angle"] = 3
    still_deg: Annotated[float, Bounds(0.01, 5), "a head that moved more while the frame was taken makes it useless"] = 0.2
    timeout_s: Annotated[float, Bounds(0.1, 60), "time for the frames at each angle"] = 4.0
    # fmt: on


class LensStep(NamedTuple):
    """Contribution of one frame.

    number: number of the frame; corners: number of detected corners; kept: whether it is a view
    why: reason why it was not kept; coverage: coverage so far and the next instruction
    """

    number: int
    corners: int
    kept: bool
    why: str
    coverage: Coverage


class LensSteps:
    """Collects frames of a board in the user's hands until they cover the whole lens."""

    def __init__(
        self, board: CharucoBoard, view_rad: float, params: LensCalibrationParams | None = None
    ) -> None:
        self._board, self._view_rad = board, view_rad
        self._params = params if params is not None else LensCalibrationParams()
        self._collector: ViewCollector | None = None
        self._size = (0, 0)

    def take(self, shot: Shot) -> LensStep:
        """Detect the board in a frame and keep the view if it is new.

        Raises:
            CameraError: the size of the frames has changed.
        """
        height, width = shot.image.shape[:2]
        if self._collector is None:
            self._size = (width, height)
            guess = intrinsics_of_view(self._view_rad, width, height)
            self._collector = ViewCollector(guess, width, height, self._params.views)
        if self._size != (width, height):
            raise CameraError(
                f"the camera changed from {self._size[0]} x {self._size[1]} to {width} x {height} "
                "pixels: a lens is measured on images of one size; start again"
            )
        seen = self._board.find(shot.image)
        why = self._collector.offer(seen)
        corners = 0 if seen is None else len(seen.ids)
        return LensStep(shot.number, corners, not why, why, self._collector.coverage)

    def try_result(self) -> tuple[LensCalibration | None, str]:
        """Return the lens, or None and the reason why more views are needed.

        Raises:
            CameraCalibrationRefused: more views will not help.
        """
        try:
            return self.result(), ""
        except CameraCalibrationRefused as refused:
            kept = 0 if self._collector is None else len(self._collector.views)
            if kept >= self._params.views.most_views:
                raise
            return None, str(refused)

    def result(self) -> LensCalibration:
        """Return the lens.

        Raises:
            CameraCalibrationRefused: the views do not determine it.
        """
        views: Sequence[DetectedBoard] = (
            self._collector.views if self._collector is not None else ()
        )
        width, height = self._size if self._collector is not None else (1, 1)
        guess = intrinsics_of_view(self._view_rad, width, height)
        return calibrate_lens(views, guess, width, height, self._params)


class Neck(Protocol):
    """Moves the head."""

    def turn(self, head_rad: Angles3) -> None:
        """Move gently to a yaw, pitch and roll; return when the head has arrived.

        Raises:
            DriverError: the movement is not possible.
        """
        ...

    def rest(self, seconds: float) -> None:
        """Hold still for a time, and keep the servos' watchdog from expiring."""
        ...

    def angles(self) -> Angles3:
        """Return yaw, pitch and roll as last measured."""
        ...


class NeckStep(NamedTuple):
    """Contribution of one neck angle.

    number, step_count: number of the angle, and of all; asked_rad: requested yaw, pitch, roll
    corners: number of corners detected in every frame; view: the view, or None and why not
    """

    number: int
    step_count: int
    asked_rad: Angles3
    corners: int
    view: NeckView | None
    why: str


def neck_angles(
    ranges_rad: tuple[Angles2, Angles2, Angles2],
    lens: Intrinsics,
    width_px: int,
    height_px: int,
    params: NeckStepParams | None = None,
) -> tuple[Angles3, ...]:
    """Plan angles at which a board straight ahead stays in the image.

    ranges_rad: lowest and highest permitted yaw, pitch and roll of the neck
    """
    par = params if params is not None else NeckStepParams()
    half = (degrees(atan(0.5 * width_px / lens.fx_px)), degrees(atan(0.5 * height_px / lens.fy_px)))
    far_deg = (min(par.yaw_deg, 0.55 * half[0]), min(par.pitch_deg, 0.5 * half[1]), par.roll_deg)

    def within(axis: int, share: float) -> float:
        # A tenth of the range is not used: no view is taken at its ends.
        low, high = (0.9 * end for end in ranges_rad[axis])
        return min(max(share * radians(far_deg[axis]), low), high)

    planned = [(within(0, yaw), within(1, pitch), within(2, roll)) for yaw, pitch, roll in _PATTERN]
    return tuple(dict.fromkeys(planned))


def neck_steps(
    neck: Neck,
    look: Look,
    now_s: Callable[[], float],
    board: CharucoBoard,
    geometry: HeadGeometry,
    angles_rad: Sequence[Angles3],
    params: NeckStepParams | None = None,
) -> Iterator[NeckStep]:
    """View the board from one neck angle after another, and straight ahead at the end.

    geometry: gives the head's pose for measured angles

    Raises:
        DriverError: head or camera have failed.
    """
    par = params if params is not None else NeckStepParams()
    for number, asked in enumerate(angles_rad, 1):
        neck.turn(asked)
        seen, angles, why = _average_view(neck, look, now_s, board, par)
        corners = 0 if seen is None else len(seen.ids)
        view = None if seen is None else NeckView(*geometry.head_pose(angles), seen)
        yield NeckStep(number, len(angles_rad), asked, corners, view, why)
    neck.turn((0.0, 0.0, 0.0))


def _average_view(
    neck: Neck, look: Look, now_s: Callable[[], float], board: CharucoBoard, params: NeckStepParams
) -> tuple[DetectedBoard | None, Angles3, str]:
    """Average the board over some frames taken while the head was still."""
    sights: list[DetectedBoard] = []
    stood: list[Angles3] = []
    last_s = start_s = now_s()
    why = "no new frame came"
    while len(sights) < params.frames and now_s() - start_s < params.timeout_s:
        before = neck.angles()
        neck.rest(0.04)
        shot = look()
        # A frame from before the head came to rest shows the board from another position.
        if shot is None or shot.captured_s <= last_s:
            continue
        last_s = shot.captured_s
        neck.rest(0.02)
        after = neck.angles()
        if max(abs(a - b) for a, b in zip(before, after, strict=True)) > radians(params.still_deg):
            why = "the head does not hold still"
            continue
        seen = board.find(shot.image)
        if seen is None:
            why = "no board seen"
            continue
        sights.append(seen)
        stood.append(after)
    common = set.intersection(*(set(seen.ids.tolist()) for seen in sights)) if sights else set()
    if len(sights) < params.frames or len(common) < LEAST_CORNERS:
        return None, neck.angles(), why
    kept = [np.isin(seen.ids, sorted(common)) for seen in sights]
    places = [seen.corners_px[keep] for seen, keep in zip(sights, kept, strict=True)]
    first, of_first = sights[0], kept[0]
    mean = DetectedBoard(
        first.ids[of_first], np.mean(places, axis=0), first.corners_board_m[of_first]
    )
    yaw, pitch, roll = np.mean(stood, axis=0).tolist()
    return mean, (yaw, pitch, roll), ""
