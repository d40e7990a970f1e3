"""Conversion of the control loop's data into the messages of a recording."""

from typing import Any

from gazerig.drivers.types import BusHealth, ImageArray
from gazerig.gaze.types import GazeCommand, GazeState, Vec3
from gazerig.robot.control.tick_stream import TickRow, all_finite, decode_plain
from gazerig.robot.model.types import GuardResult, JointState
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import viewer_messages as viewers
from gazerig.robot.recording.run_writer import RunWriter
from gazerig.robot.recording.tick_record import as_json, percept_as_json

_PERCEPT, _JOINTS = TickRow._fields.index("percept"), TickRow._fields.index("joints")
_VIEWED_EVERY_S = 0.0399  # a little under 40 ms, so that rounding does not turn it into 45


class RecordRouter:
    """A writer of one run's messages in the order of the calls."""

    def __init__(self, writer: RunWriter) -> None:
        self._writer = writer
        self._first_s: float | None = None
        self._at_s = 0.0
        self._viewed_s = -1.0
        self._newest: list[Any] | None = None
        self._faces: list[Vec3] = []
        self._percepts: dict[int, list[Any]] = {}
        self._written = 0
        self._finite = False

    def ticks(self, data: bytes) -> None:
        """Write the ticks of a ``tick_stream.TickBatch``, each percept before the first with it."""
        percepts, rows = decode_plain(data)
        self._finite = all_finite(data)
        self._percepts.update({one[0]: one for one in percepts})
        for row in rows:
            number = row[_PERCEPT]
            if number is not None and number > self._written:
                self._written = number
                percept = percept_as_json(self._percepts[number], self._finite)
                self._faces = [face["p_world_m"] for face in percept["faces"]]
                self._add(fmt.PERCEPT, percept)
                self._percepts = {n: one for n, one in self._percepts.items() if n > number}
            self._tick(row)

    def _tick(self, row: list[Any]) -> None:
        """Write a tick, and about every 40 ms the messages for viewers."""
        data = as_json(row, self._finite)
        if self._first_s is None:
            self._first_s = data["t_s"]
        self._at_s = data["t_s"] - self._first_s
        self._add(fmt.TICK, data)
        for event in data["events"]:
            self._add(fmt.LOG, viewers.line(event, self._now_ns))
        for order in data["commands"]:
            self._add(fmt.ORDER, order)
        self._newest = row
        if self._at_s - self._viewed_s >= _VIEWED_EVERY_S or self._viewed_s < 0.0:
            self._viewed_s = self._at_s
            self._show(TickRow(*row))

    def frame(self, captured_s: float, image: ImageArray) -> None:
        """Write a camera image as JPEG."""
        from gazerig.robot.dashboard.feed.camera_overlay import encode  # loads OpenCV

        first_s = self._first_s if self._first_s is not None else captured_s
        exposed_ns = self._writer.time_ns(captured_s - first_s)
        self._add(fmt.FRAME, viewers.image(encode(image), captured_s, exposed_ns))

    def health(self, bus: BusHealth, lost: int) -> None:
        """Write the bus counts and the servos' readings of the newest tick."""
        servos = {}
        if self._newest is not None:
            joints = JointState(*self._newest[_JOINTS])
            fields = ("temperature_c", "voltage_v", "load", "fault")
            servos = {name: getattr(joints, name) for name in fields}
        counts = {"tx_bytes": bus.tx_bytes, "rx_bytes": bus.rx_bytes, "errors": dict(bus.errors)}
        self._add(fmt.HEALTH, {**counts, **servos, "lost_ticks": lost})

    @property
    def _now_ns(self) -> int:
        return self._writer.time_ns(self._at_s)

    def _show(self, row: TickRow) -> None:
        """Write the messages for viewers."""
        now_ns = self._now_ns
        joints, names = JointState(*row.joints), GuardResult(*row.guard_result).joints
        pose, gaze = GazeState(*row.pose), GazeCommand(*row.gaze)
        self._add(fmt.JOINT_STATES, viewers.joint_states(names, joints, now_ns))
        self._add(fmt.TRANSFORMS, viewers.transforms(pose, now_ns))
        self._add(fmt.SCENE, viewers.scene(pose, gaze.gaze_point_world_m, self._faces, now_ns))

    def _add(self, topic: str, data: dict[str, Any]) -> None:
        self._writer.add(fmt.Message(topic, self._at_s, data))
