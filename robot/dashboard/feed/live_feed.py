"""State of a running rig as the page shows it, computed in the page's process from ticks.

All data that is only shown is computed here, at the page's rate: texts, eye movements, the
commanded pose, and the camera image with the detections drawn in. The control loop sends plain
ticks, and other data (``RunState``) when it has changed.
"""

import json
import pickle
import time
from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar, NamedTuple

import numpy as np
from msgspec import UNSET, structs

from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink
from gazerig.drivers.process.passed_image import PassedImage, receive, take_image
from gazerig.drivers.types import Detections, ImageArray
from gazerig.gaze.types import Floats, Mat3, Percept, Vec3
from gazerig.robot.control.tick import Tick, TickRecord
from gazerig.robot.control.tick_stream import decode, encode
from gazerig.robot.dashboard.feed.gaze_trail import GazeHistory, GazeTrail
from gazerig.robot.dashboard.feed.page_process import (
    CHOICES,
    MESSAGE,
    PARAMS,
    TRACKS,
    VALUES,
)
from gazerig.robot.dashboard.feed.snapshot import RunState, ShownRig, SnapshotBuilder
from gazerig.robot.dashboard.feed.world_shapes import WorldShapes
from gazerig.robot.dashboard.requests.inbox import MESSAGE_BYTES
from gazerig.robot.description.build import RigShape
from gazerig.robot.model.frames import PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens, project
from gazerig.robot.model.scene_view import PinholeView, SceneView
from gazerig.robot.model.types import Snapshot

TICKS, RIG, STATE, DETECTED = b"t", b"g", b"a", b"d"
"""First bytes of messages: a ``TickBatch``, a ``LiveRig``, a ``RunState``, and a frame."""

_DRAWING_SHARE = 0.1
"""Largest share of a processor for drawing images of a simulated camera that delivers none."""
_NEAREST_M = 0.05
"""Smallest distance of drawn points from the plane of the camera, m."""


class LiveRig(NamedTuple):
    """Constant properties of a running rig, and its geometry.

    emulated: whether its servos are emulated and not being calibrated
    picture: draws the image of a simulated camera; None without one, or if it returns images
    world: appearance of the simulated world around the rig; None without one
    detector: detector of faces and people, and what it lacks; "" if none runs
    choice: settings chosen for this computer, in one line; "" if nothing was measured
    """

    shown: ShownRig
    emulated: bool = False
    picture: SceneView | None = None
    world: WorldShapes | None = None
    detector: str = ""
    choice: str = ""


class ShownWorld(NamedTuple):
    """Simulated world, and the time since its start, s."""

    shapes: WorldShapes
    world_s: float


class ShownFrame(NamedTuple):
    """Detections of a frame, without its images, and the image to draw them into.

    found: its lens is the one with which the frame was located, else the one that the camera
        reports
    image: array in the attached memory, None without one
    """

    found: Detections
    image: PassedImage | None


def rig_message(rig: LiveRig) -> bytes:
    """Return a message with the rig's properties, and the servo models of other packages."""
    return RIG + pickle.dumps((SERVOS, *rig), pickle.HIGHEST_PROTOCOL)


def state_message(state: RunState) -> bytes:
    """Return a message with the state that ticks do not contain."""
    return STATE + encode(state)


def frame_message(found: Detections, image: PassedImage | None) -> bytes:
    """Return a message with the detections of a frame; see ``ShownFrame``."""
    # Not by replace: a frame of the camera's process reads its image when it is asked for.
    plain = Detections(
        found.captured_s,
        found.number,
        found.width_px,
        found.height_px,
        tuple([replace(face, mesh=None) for face in found.faces]),  # it is not drawn
        found.blobs,
        lens=found.located.intrinsics if found.located is not None else found.lens,
        people=found.people,
        conditions=found.conditions,
    )
    return DETECTED + encode(ShownFrame(plain, image))


class LiveFeed:
    """Receives the rig's messages; returns the data to show.

    emulated: whether the servos are emulated; False before the first message
    choice: see ``LiveRig``
    choices: layers selected for the camera image
    watched: whether a browser shows the images; otherwise none is drawn
    shown_s: time of the shown data, of the newest tick
    """

    def __init__(self) -> None:
        self.emulated = False
        self.choice = ""
        self.choices = OverlayChoices()
        self.watched = True
        self.shown_s: float | None = None
        self._picture: SceneView | None = None
        self._undrawn_s = inf, -inf
        self._world: WorldShapes | None = None
        self._detector = ""
        self._trail, self._gaze = GazeTrail(), GazeHistory()
        self._builder: SnapshotBuilder | None = None
        self._poses: PoseHistory | None = None
        self._percept: Percept | None = None
        self._state = RunState({}, "", "", "")
        self._found: Detections | None = None
        self._newest: Tick | None = None
        self._new_ticks = self._new_frame = False

    def handle_message(self, message: bytes, fd: int = -1) -> bool:
        """Handle a message of one of the kinds above; return False for others.

        Messages must come from the process that started this one.
        """
        kind, body = message[:1], message[1:]
        if kind == TICKS:
            self._take_ticks(body)
        elif kind == STATE:
            self._state = decode(body, RunState)
        elif kind == RIG:
            models, *parts = pickle.loads(body)
            SERVOS.update(models)
            rig = LiveRig(*parts)
            if self._builder is None:
                self._builder = SnapshotBuilder(rig.shown)
                self._poses = PoseHistory(rig.shown.kinematics)
            self._builder.rig = rig.shown
            self.emulated, self.choice = rig.emulated, rig.choice
            self._picture, self._detector = rig.picture, rig.detector
            # Sent again with every change of the rig; equal parts are kept, because they are
            # already drawn.
            if pickle.dumps(rig.world) != pickle.dumps(self._world):
                self._world = rig.world
        elif kind == DETECTED:
            self._take_frame(decode(body, ShownFrame), fd)
        else:
            return False
        return True

    def snapshot(self) -> Snapshot | None:
        """Return the rig's state and its events since the last call; None without new ticks."""
        if not self._new_ticks or self._builder is None:
            return None
        self._new_ticks = False
        return self._builder.build(self._state, self._detector)

    @property
    def shape(self) -> RigShape | None:
        """Geometry of the rig's parts; None if unknown."""
        rig = self._builder.rig if self._builder is not None else None
        return rig.shape if rig is not None else None

    def world(self) -> ShownWorld | None:
        """Return the simulated world to be shown; None without one, or before its data."""
        start_s, t_s = self._state.scene_start_s, self.shown_s
        if self._world is None or start_s is None or t_s is None:
            return None
        return ShownWorld(self._world, t_s - start_s)

    def image(self) -> ImageArray | None:
        """Return the newest frame with its detections; None without a new one."""
        tick, found, builder, poses = self._newest, self._found, self._builder, self._poses
        if not (self._new_frame and self.watched):
            return None
        if tick is None or found is None or builder is None or poses is None:
            return None
        begin_s, end_s = self._undrawn_s
        if found.image is None and begin_s < found.captured_s < end_s:
            return None
        self._new_frame = False
        assert builder.rig is not None  # it was in the first message
        field_rad = builder.rig.horizontal_rad
        lens = intrinsics_of_lens(None, field_rad, found.width_px, found.height_px, found.lens)
        R, p_m = builder.rig.mount.pose(*poses.head_pose(found.captured_s))
        start_s = self._state.scene_start_s
        if found.image is None and self._picture is not None and start_s is not None:
            size_px = found.width_px, found.height_px
            seen_by = PinholeView(found.captured_s - start_s, lens, size_px, R, p_m)
            began_s = time.thread_time()
            found = replace(found, image=self._picture.draw(seen_by))
            pause_s = (time.thread_time() - began_s) / _DRAWING_SHARE
            self._undrawn_s = found.captured_s, found.captured_s + pause_s
        # The page's process draws; the control loop's imports this module too, without OpenCV.
        from gazerig.robot.dashboard.feed.camera_overlay import draw_detections

        points_m = self._trail.points() if self.choices.heat else None
        return draw_detections(
            found.image,
            found,
            gaze_pixel(self._gaze.at(found.captured_s), R, p_m, lens)
            if self.choices.gaze
            else None,
            lens,
            # Without an image only the detections can be drawn.
            faces=self.choices.faces or found.image is None,
            heat_px=None if points_m is None else project_points(points_m, R, p_m, lens),
        )

    def _take_ticks(self, data: bytes) -> None:
        if self._builder is None or self._poses is None:
            return
        for record in decode(data, list[TickRecord]):
            if record.percept is not UNSET:
                self._percept = record.percept
            tick = structs.replace(record.tick, detections=self._found, percept=self._percept)
            self._builder.update(tick)
            self._poses.remember(tick.t_s, tick.pose.head_rad, tick.pose.base_rad)
            self._newest, self.shown_s = tick, tick.t_s
            self._trail.add(tick.t_s, tick.gaze.gaze_point_world_m)
            self._gaze.add(tick.t_s, tick.gaze.gaze_point_world_m)
        self._new_ticks = True

    def _take_frame(self, frame: ShownFrame, fd: int) -> None:
        found = frame.found
        if frame.image is not None and fd >= 0:
            array = take_image(frame.image._replace(fd=fd))
            found = replace(found, image=array)
        self._found, self._new_frame = found, True


def gaze_pixel(point_m: Vec3, R: Mat3, p_m: Vec3, lens: Intrinsics) -> tuple[float, float] | None:
    """Return the gaze point in the image of a camera at (R, p_m), None if it is behind it."""
    found = project_points(np.array([point_m]), R, p_m, lens).tolist()
    return (found[0][0], found[0][1]) if found else None


def project_points(points_world_m: Floats, R: Mat3, p_m: Vec3, lens: Intrinsics) -> Floats:
    """Return points (n, 3) in the image of a camera at (R, p_m), without those behind it."""
    seen: Floats = (points_world_m - np.array(p_m)) @ np.array(R)
    return np.asarray(project(seen[seen[:, 2] >= _NEAREST_M], lens), np.float64).reshape(-1, 2)


@dataclass
class OverlayChoices:
    """Selected layers; users of the page change them."""

    gaze: bool = True
    faces: bool = False
    heat: bool = False
    ghost: bool = False
    sight: bool = False
    camera: bool = False
    eyes: bool = False
    parts: bool = False

    NAMES: ClassVar[dict[str, str]] = {
        "gaze": "picture: where the head looks",
        "faces": "picture: faces and what moves, as found",
        "heat": "picture: where the head has looked",
        "ghost": "ghost of the desired pose",
        "sight": "lines of sight",
        "camera": "what the camera covers",
        "eyes": "what the eyes can attend to",
        "parts": "the eight parts of a face",
    }


class News(NamedTuple):
    """Messages that waited on the socket: a snapshot, a frame, and whether it has closed.

    snapshots: one, or none without new ticks
    image: a frame with its detections, BGR
    world: the simulated world around the rig, if any
    shape: geometry of the rig, if known
    others: messages that must not be lost or skipped, as (kind, content of the JSON), oldest first
    """

    snapshots: tuple[Snapshot, ...]
    ended: bool
    others: tuple[tuple[bytes, object], ...] = ()
    image: ImageArray | None = None
    world: ShownWorld | None = None
    shape: RigShape | None = None


def read_waiting(feed: MessageLink, live: LiveFeed) -> News:
    """Return all messages that wait, without waiting for more.

    live: receives the messages of a running rig
    """
    others: list[tuple[bytes, object]] = []
    ended = False
    while not ended:
        try:
            message, fd = receive(feed, MESSAGE_BYTES, DONT_WAIT)
        except BlockingIOError:
            break
        except ConnectionResetError:
            message, fd = b"", -1
        ended = not message
        kind, body = message[:1], message[1:]
        if kind in (CHOICES, TRACKS, PARAMS, VALUES, MESSAGE):
            others.append((kind, json.loads(body)))
        else:
            live.handle_message(message, fd)
    newest = live.snapshot()
    snapshots = () if newest is None else (newest,)
    return News(snapshots, ended, tuple(others), live.image(), live.world(), live.shape)
