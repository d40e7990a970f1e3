"""Stream of ticks to other processes, encoded in batches, once for all receivers.

If each tick is encoded at its end, neither code nor encoder are in the processor's cache; a
batch several times per second takes a third of that time. MessagePack keeps every number bit for
bit.
"""

import re
from collections.abc import Callable, Sequence
from math import inf
from operator import attrgetter
from typing import Any, NamedTuple

import msgspec
import numpy as np

from gazerig.gaze.types import Bodies, Face, GazeCommand, GazeState, Mat3, Percept, Target, Vec3
from gazerig.robot.control.observers import failure_text
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.control_source import ControlState, TrackState
from gazerig.robot.model.conversation import ConversationState
from gazerig.robot.model.types import GuardResult, JointAngles, JointState

LIVE_S = 0.0399  # slightly below 40 ms, so that rounding does not make it 45
"""Time between two batches of a run in real time."""
SIMULATED_S = 0.2
"""Time between two batches in simulated time, without viewers."""

Before = Sequence[tuple[str, Any]]
"""Further inputs of a run besides a tick's own fields: kind and plain values of each."""


_FaceRow = tuple[
    int,
    Vec3,
    Vec3,
    Mat3,
    tuple[Vec3, ...],
    float,
    str,
    float,
    float,
    float | None,
    bool | None,
    Vec3 | None,
    float | None,
    float | None,
    bool | None,
]  # the fields of a Face


class TickRow(NamedTuple):
    """A tick as the receiver reads it; fields as in ``Tick``.

    Attributes:
        dt_s: Time since the previous tick.
        percept: Number of the percept, None without one.
        command_is_desired: Whether ``guard_result.desired_rad`` equals ``desired_rad``.
        commands: Plain values of the commands.
        before: Further inputs of the run, for a recording.
    """

    t_s: float
    dt_s: float
    percept: int | None
    joints: JointState
    pose: GazeState
    target: Target
    gaze: GazeCommand
    desired_rad: JointAngles
    guard_result: GuardResult
    command_is_desired: bool
    events: tuple[str, ...]
    commands: list[Any]
    stopped: str
    controlled_by: str
    client_control: ControlState
    tracks: tuple[TrackState, ...]
    parking: bool
    conversation: ConversationState
    before: list[Any]


class _PerceptRow(NamedTuple):
    """A percept as the receiver reads it; bodies: the columns of ``Bodies``."""

    number: int
    captured_s: float
    bodies: tuple[Any, ...]
    faces: list[_FaceRow]
    scene: int


class TickBatch(NamedTuple):
    """A batch of ticks in the order of time.

    Attributes:
        data: [percepts, rows]: the new percepts of these ticks, each as
            [number, captured_s, bodies, faces], and the fields of ``TickRow`` of each tick.
        ticks: Number of ticks.
        newest: The last tick.
    """

    data: bytes
    ticks: int
    newest: Tick


class TickStream:
    """A stream of ticks to sinks in batches; used only in the loop's thread.

    Args:
        report: Receives one line about each sink that fails and is removed.
        every_s: Time between two batches.
    """

    def __init__(self, report: Callable[[str], None], every_s: float = LIVE_S) -> None:
        self._report, self._every_s = report, every_s
        self._sinks: tuple[tuple[str, Callable[[TickBatch], bool]], ...] = ()
        self._ticks: list[tuple[Tick, float, Before]] = []
        self._due_s = -inf
        self._percept: Percept | None = None
        self._number = 0
        self._again = False

    def add_sink(self, name: str, take: Callable[[TickBatch], bool]) -> None:
        """Add a sink, which returns False if it loses a batch."""
        self._sinks = (*self._sinks, (name, take))

    def update(self, tick: Tick) -> None:
        """Add a tick of a run that is not recorded."""
        self.append(tick, 0.0, ())

    def append(self, tick: Tick, dt_s: float, before: Before) -> None:
        """Add a tick with its further inputs, and send a batch when it is due."""
        self._ticks.append((tick, dt_s, before))
        if not 0.0 <= self._due_s - tick.t_s <= self._every_s:
            self.flush()
            self._due_s = tick.t_s + self._every_s

    def flush(self) -> None:
        """Send the ticks since the last batch."""
        ticks = self._ticks
        if not ticks or not self._sinks:
            ticks.clear()
            return
        batch = TickBatch(self._encode_batch(), len(ticks), ticks[-1][0])
        ticks.clear()
        for sink in self._sinks:
            try:
                self._again |= not sink[1](batch)
            except Exception as error:
                self._sinks = tuple([one for one in self._sinks if one is not sink])
                self._report(failure_text(sink[0], error))

    def _encode_batch(self) -> bytes:
        percepts, rows = [], []
        if self._again:  # a sink that lost a batch may have lost the present percept
            self._again = False
            if self._percept is not None:
                percepts.append(_percept_row(self._number, self._percept))
        for tick, dt_s, before in self._ticks:
            percept, guard = tick.percept, tick.guard_result
            if percept is not None and percept is not self._percept:
                self._percept = percept
                self._number += 1
                percepts.append(_percept_row(self._number, percept))
            rows.append((
                tick.t_s, dt_s, None if percept is None else self._number, tick.joints, tick.pose,
                tick.target, tick.gaze, tick.desired_rad, guard,
                guard.desired_rad == tick.desired_rad, tick.events,
                tick.commands, tick.stopped, tick.controlled_by,
                tick.client_control, tick.tracks, tick.parking, tick.conversation, before,
            ))  # fmt: skip
        return encode((percepts, rows))


def encode(value: object) -> bytes:
    """Return plain values, named tuples and arrays as MessagePack.

    Raises:
        TypeError: A value has another type.
    """
    try:
        return _encoder.encode(value)
    except UnicodeEncodeError:  # a file or device name that is not text
        return _encoder.encode(_to_utf8(msgspec.to_builtins(value, enc_hook=_to_plain)))


def decode_rows(data: bytes) -> tuple[dict[int, Percept], list[TickRow]]:
    """Return the percepts of ``TickBatch.data`` by number, and its ticks.

    Raises:
        msgspec.MsgspecError: The data is not a batch.
    """
    percepts, rows = _rows.decode(data)
    return {row.number: _read_percept(row) for row in percepts}, rows


def decode_plain(data: bytes) -> Any:
    """Return the values of MessagePack as plain lists, with the types of numbers unchanged.

    Raises:
        msgspec.MsgspecError: The data is not MessagePack.
    """
    return _plain.decode(data)


def all_finite(data: bytes) -> bool:
    """Return True if all numbers in MessagePack are finite, False if one may not be."""
    return _NOT_FINITE.search(data) is None


def _read_percept(row: _PerceptRow) -> Percept:
    """Return a percept from the row of ``_percept_row``."""
    ids, kinds, p_m, v_m_s, w_rad_s, radius_m, cov = row.bodies
    p, v, w = (np.array(rows, float).reshape(-1, 3) for rows in (p_m, v_m_s, w_rad_s))
    pv_cov = None if cov is None else np.array(cov, float).reshape(-1, 6, 6)
    bodies = Bodies(tuple(ids), tuple(kinds), p, v, w, np.array(radius_m, float), pv_cov)
    return Percept(row.captured_s, bodies, tuple([Face(*face) for face in row.faces]), row.scene)


def _percept_row(number: int, percept: Percept) -> tuple[Any, ...]:
    faces = [_face_values(face) for face in percept.faces]
    return (number, percept.captured_s, _body_values(percept.bodies), faces, percept.scene)


def _to_plain(value: Any) -> Any:
    """Return a NumPy array or number as a list or a Python number."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not part of a tick")


def _to_utf8(value: Any) -> Any:
    """Replace texts that cannot be written as UTF-8."""
    if isinstance(value, str):
        return value.encode(errors="replace").decode()
    if isinstance(value, tuple | list):
        return [_to_utf8(item) for item in value]
    if isinstance(value, dict):
        return {_to_utf8(key): _to_utf8(item) for key, item in value.items()}
    return value


_NOT_FINITE = re.compile(rb"\xcb[\x7f\xff][\xf0-\xff]")
"""A double whose exponent has all bits set: nan, inf or, by chance, other equal bytes."""
# msgspec would encode a frozen dataclass with the names of its fields.
_body_values = attrgetter(*Bodies.__slots__)
_face_values = attrgetter(*Face.__slots__)
_encoder = msgspec.msgpack.Encoder(enc_hook=_to_plain)
_plain = msgspec.msgpack.Decoder()
_rows = msgspec.msgpack.Decoder(tuple[list[_PerceptRow], list[TickRow]])
