"""A running rig in the page's process: its newest tick, its geometry, its pictures.

The control loop sends plain ticks, and other data when it has changed. All data that is only shown
is computed here, at the page's rate.
"""

import pickle
import time
from bisect import bisect_left
from collections import Counter, deque
from dataclasses import replace
from math import inf
from operator import itemgetter
from typing import NamedTuple

from msgspec import UNSET, structs

from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink
from gazerig.drivers.process.passed_image import PassedImage, receive, take_image
from gazerig.drivers.types import Detections
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.dashboard.feed.page_process import MESSAGE_BYTES
from gazerig.robot.dashboard.feed.world_shapes import WorldShapes
from gazerig.robot.description.build import RigShape
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.tick import Tick, TickRecord
from gazerig.robot.loop.tick_stream import decode, encode
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.model.scene import PinholeView, SceneView
from gazerig.robot.net.topics import RigInfo, RunState, ShownPicture

TICKS, RIG, STATE, DETECTED = b"t", b"g", b"a", b"d"
"""First bytes of messages: a ``TickBatch``, a ``LiveRig``, a ``RunState``, and a frame."""
_KEPT = 400
"""Number of gaze points that are kept for frames which arrive late: those of two seconds."""
_DRAWING_SHARE = 0.06
"""Largest share of a processor for drawing images of a simulated camera that delivers none."""


class ShownRig(NamedTuple):
    """Geometry of a rig as it is shown."""

    kinematics: Kinematics
    mount: CameraMount
    horizontal_rad: float
    shape: RigShape


class LiveRig(NamedTuple):
    """A running rig.

    picture: draws the image of a simulated camera; None without one, or if it returns images
    world: appearance of the simulated world around the rig; None without one
    """

    shown: ShownRig
    info: RigInfo
    picture: SceneView | None = None
    world: WorldShapes | None = None


class ShownWorld(NamedTuple):
    """Simulated world, and the time since its start, s."""

    shapes: WorldShapes
    world_s: float


class ShownHead(NamedTuple):
    """A rig in one tick."""

    tick: Tick
    rig: ShownRig


class ShownFrame(NamedTuple):
    """Detections of a frame, without its images, and the image.

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
        palms=found.palms,
        conditions=found.conditions,
    )
    return DETECTED + encode(ShownFrame(plain, image))


class RigFeed:
    """Receives the rig's messages.

    Attributes:
        ticks: The newest tick and the last events; other threads may read it.
        rig: The rig, None before its first message.
        ended: Whether the rig has closed the connection.
    """

    def __init__(self) -> None:
        self.ticks = TickFeed()
        self.rig: LiveRig | None = None
        self.ended = False
        self._run = RunState()
        self._unanswered: Counter[str] = Counter()
        self._poses: PoseHistory | None = None
        self._gaze: deque[tuple[float, Vec3]] = deque(maxlen=_KEPT)
        self._percept: Percept | None = None
        self._found: Detections | None = None
        self._new_frame = False
        self._undrawn_s = inf, -inf

    def read_waiting(self, link: MessageLink) -> None:
        """Take all messages that wait, without waiting for more."""
        while not self.ended:
            try:
                message, fd = receive(link, MESSAGE_BYTES, DONT_WAIT)
            except BlockingIOError:
                return
            except ConnectionResetError:
                message, fd = b"", -1
            self.ended = not message
            self.take(message, fd)

    def take(self, message: bytes, fd: int = -1) -> None:
        """Take a message, which must come from the process that started this one."""
        kind, body = message[:1], message[1:]
        if kind == TICKS:
            self._take_ticks(body)
        elif kind == STATE:
            self._run = decode(body, RunState)
        elif kind == RIG:
            models, *parts = pickle.loads(body)
            SERVOS.update(models)
            rig = LiveRig(*parts)
            if self.rig is None:
                self._poses = PoseHistory(rig.shown.kinematics)
            elif pickle.dumps(rig.world) == pickle.dumps(self.rig.world):
                # Sent again with every change of the rig; an equal world is already drawn.
                rig = rig._replace(world=self.rig.world)
            self.rig = rig
        elif kind == DETECTED:
            frame = decode(body, ShownFrame)
            found = frame.found
            if frame.image is not None and fd >= 0:
                found = replace(found, image=take_image(frame.image._replace(fd=fd)))
            self._found, self._new_frame = found, True

    def _take_ticks(self, data: bytes) -> None:
        if self._poses is None:
            return
        for record in decode(data, list[TickRecord]):
            if record.percept is not UNSET:
                self._percept = record.percept
            tick = structs.replace(record.tick, detections=self._found, percept=self._percept)
            self._unanswered.update(tick.joints.missing)
            self._poses.remember(tick.t_s, tick.pose.head_rad)
            self._gaze.append((tick.t_s, tick.gaze.gaze_point_world_m))
            self.ticks.update(tick)

    def run_state(self) -> RunState:
        """Return the state of the run."""
        tick, rig = self.ticks.newest, self.rig
        if tick is None or rig is None:
            return self._run
        texts = perception_text(tick), rig.info.detector
        return structs.replace(
            self._run,
            perception=" | ".join(filter(None, texts)),
            unanswered=dict(self._unanswered),
        )

    def shown_head(self) -> ShownHead | None:
        """Return the rig in its newest tick; None before the first."""
        tick, rig = self.ticks.newest, self.rig
        if tick is None or rig is None:
            return None
        return ShownHead(tick, rig.shown)

    def shown_world(self) -> ShownWorld | None:
        """Return the simulated world to be shown; None without one, or before its data."""
        start_s, tick = self._run.scene_start_s, self.ticks.newest
        if self.rig is None or self.rig.world is None or start_s is None or tick is None:
            return None
        return ShownWorld(self.rig.world, tick.t_s - start_s)

    def picture(self) -> ShownPicture | None:
        """Return the newest frame; None without a new one."""
        found, rig, poses = self._found, self.rig, self._poses
        if not self._new_frame or self.ticks.newest is None:
            return None
        assert found is not None and rig is not None and poses is not None
        begin_s, end_s = self._undrawn_s
        if found.image is None and begin_s < found.captured_s < end_s:
            return None
        self._new_frame = False
        shown = rig.shown
        size_px = found.width_px, found.height_px
        lens = intrinsics_of_lens(None, shown.horizontal_rad, *size_px, found.lens)
        R, p_m = shown.mount.pose(*poses.head_pose(found.captured_s))
        start_s = self._run.scene_start_s
        if found.image is None and rig.picture is not None and start_s is not None:
            seen_by = PinholeView(found.captured_s - start_s, lens, size_px, R, p_m)
            began_s = time.thread_time()
            found = replace(found, image=rig.picture.draw(seen_by))
            pause_s = (time.thread_time() - began_s) / _DRAWING_SHARE
            self._undrawn_s = found.captured_s, found.captured_s + pause_s
        # The page's process encodes; the control loop's imports this module too, without OpenCV.
        from gazerig.robot.dashboard.feed.camera_picture import camera_picture

        first_later = bisect_left(self._gaze, found.captured_s, key=itemgetter(0))
        _, point_m = self._gaze[min(first_later, len(self._gaze) - 1)]
        return camera_picture(found, lens, R, p_m, point_m)


def perception_text(tick: Tick) -> str:
    """Return age of the frame, camera conditions and distances of faces.

    e.g. "frame 63 ms old | face 1 at 0.98 m by camera, +- 1 cm"
    """
    if tick.percept is None:
        return "no frame yet"
    parts = [f"frame {1e3 * tick.percept.age_s(tick.t_s):.0f} ms old", *tick.camera_conditions]
    head = tick.pose.p_world_head_m
    for face in tick.percept.faces:
        parts.append(
            f"face {face.id} at {norm(sub(face.p_world_m, head)):.2f} m by {face.distance_from}, "
            f"+- {100.0 * face.along_sd_m:.0f} cm"
            + (", looks at the head" if face.looks_at_head else "")
            + (", speaks" if face.speaks else "")
        )
    return " | ".join(parts)
