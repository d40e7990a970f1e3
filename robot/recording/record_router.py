"""Turns what the control loop hands over into the messages of a recording."""

from typing import Any

from gazerig.drivers.types import BusHealth
from gazerig.gaze.types import GazeState, Vec3
from gazerig.robot.model.types import GuardResult, JointState
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import viewer_messages as viewers
from gazerig.robot.recording.run_writer import RunWriter
from gazerig.robot.recording.tick_record import Flat, as_json, percept_as_json

_VIEWED_EVERY_S = 0.0399  # a little under 40 ms, so that rounding does not turn it into 45


class RecordRouter:
    """Writes one run, in the order of the calls."""

    def __init__(self, writer: RunWriter) -> None:
        self._writer = writer
        self._first_s: float | None = None
        self._at_s = 0.0
        self._viewed_s = -1.0
        self._joints: JointState | None = None
        self._names: tuple[str, ...] = ()
        self._faces: list[Vec3] = []

    def tick(self, values: Flat) -> None:
        """Write a tick as ``moment.flat`` gives it, and from time to time what viewers draw."""
        data = as_json(values)
        if self._first_s is None:
            self._first_s = data["t_s"]
        self._at_s = data["t_s"] - self._first_s
        self._add(fmt.TICK, data)
        for event in data["events"]:
            self._add(fmt.LOG, viewers.line(event, self._now_ns))
        for order in data["orders"]:
            self._add(fmt.ORDER, order)
        self._joints, self._names = JointState(*values[3]), GuardResult(*values[8]).joints
        if self._at_s - self._viewed_s >= _VIEWED_EVERY_S or self._viewed_s < 0.0:
            self._viewed_s = self._at_s
            self._show(GazeState(*values[4]), values[6][7])

    def percept(self, values: Flat) -> None:
        """Write a percept as ``moment.flat_percept`` gives it, before the ticks that go by it."""
        data = percept_as_json(values)
        self._faces = [face["p_world_m"] for face in data["faces"]]
        self._add(fmt.PERCEPT, data)

    def frame(self, captured_s: float, jpeg: bytes) -> None:
        """Write an image of the camera."""
        first_s = self._first_s if self._first_s is not None else captured_s
        exposed_ns = self._writer.time_ns(captured_s - first_s)
        self._add(fmt.FRAME, viewers.image(jpeg, captured_s, exposed_ns))

    def health(self, bus: BusHealth, lost: int) -> None:
        """Write the counts of the bus and the servos' figures of the newest tick."""
        joints = self._joints
        servos = (
            {
                name: getattr(joints, name)
                for name in ("temperature_c", "voltage_v", "load", "fault")
            }
            if joints is not None
            else {}
        )
        counts = {"tx_bytes": bus.tx_bytes, "rx_bytes": bus.rx_bytes, "errors": dict(bus.errors)}
        self._add(fmt.HEALTH, {**counts, **servos, "lost_ticks": lost})

    @property
    def _now_ns(self) -> int:
        return self._writer.time_ns(self._at_s)

    def _show(self, pose: GazeState, point_m: Vec3) -> None:
        """Write what viewers draw of the newest tick."""
        now_ns = self._now_ns
        if self._joints is not None:
            self._add(fmt.JOINT_STATES, viewers.joint_states(self._names, self._joints, now_ns))
        self._add(fmt.TRANSFORMS, viewers.transforms(pose, now_ns))
        self._add(fmt.SCENE, viewers.scene(pose, point_m, self._faces, now_ns))

    def _add(self, topic: str, data: dict[str, Any]) -> None:
        self._writer.add(fmt.Message(topic, self._at_s, data))
