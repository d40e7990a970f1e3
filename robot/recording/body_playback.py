"""Bodies that record or play back the servos' inputs to a run, and other parts of a playback.

The goals at torque-on, a second reading in one tick and a refused torque also affect
decisions. With them a recorded run can be repeated bit for bit.
"""

from collections import deque
from collections.abc import Callable
from typing import TypeVar

from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.drivers.types import Detections
from gazerig.gaze.types import Percept
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.tick import (
    BodyRecord,
    MeasuredJoints,
    TickRecord,
    TorqueEnabled,
    TorqueRefused,
)
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.model.types import JointAngles, JointState
from gazerig.robot.perception.perception import Perception

H = TypeVar("H", bound=BodyRecord)


class ForwardingBody(Body):
    """A body that forwards to the wrapped body every call that a subclass does not define."""

    def __init__(self, body: Body) -> None:
        # The initializer of Body is not called: the joints are those of the wrapped body.
        self.bus, self.names = body.bus, body.names
        self._body = body
        for name, method in vars(Body).items():
            if not name.startswith("_") and getattr(type(self), name) is method:
                setattr(self, name, getattr(body, name))


class JointRecorder(ForwardingBody):
    """A body that forwards every call and records the results."""

    def __init__(self, body: Body, note: Callable[[BodyRecord], None]) -> None:
        super().__init__(body)
        self._note = note

    def start(self, clock: Clock) -> JointAngles:
        """Start the machine and record the goals."""
        goals = self._body.start(clock)
        self._note(TorqueEnabled(goals))
        return goals

    def read(self, t_s: float) -> JointState:
        """Read all joints and record them."""
        joints = self._body.read(t_s)
        self._note(MeasuredJoints(t_s, joints))
        return joints

    def enable_torque(self) -> JointAngles:
        """Switch the torque on again and record the goals or the refusal.

        Raises:
            SetupError: A servo does not answer, refuses or has latched a fault.
            BusLost: The port is gone.
        """
        try:
            goals = self._body.enable_torque()
        except (SetupError, ServoFault) as error:
            self._note(TorqueRefused(str(error)))
            raise
        self._note(TorqueEnabled(goals))
        return goals


class PlaybackBody(ForwardingBody):
    """A body that forwards commands and returns the recorded readings.

    The wrapped body receives every call, so that the same bytes are sent on its bus as in the first
    run.
    """

    def __init__(self, body: Body) -> None:
        super().__init__(body)
        self._record: TickRecord | None = None
        self._records: deque[BodyRecord] = deque()
        self._newest: JointState | None = None

    def play(self, moment: TickRecord) -> None:
        """Set the values that are returned until the end of a tick; call once per tick."""
        if moment is not self._record:
            self._record = moment
            self._records = deque(
                (*moment.before, MeasuredJoints(moment.tick.t_s, moment.tick.joints))
            )

    def stop_playback(self) -> None:
        """Return the values of the wrapped body from now on."""
        self._records.clear()
        self._newest = None

    def start(self, clock: Clock) -> JointAngles:
        """Start the wrapped body; return the recorded goals."""
        goals = self._body.start(clock)
        said = self._next(TorqueEnabled)
        return said.goals_rad if said is not None else goals

    def read(self, t_s: float) -> JointState:
        """Return the recorded joints; a further reading returns the newest again."""
        joints = self._body.read(t_s)
        said = self._next(MeasuredJoints)
        if said is not None:
            self._newest = said.joints
        return self._newest if self._newest is not None else joints

    def enable_torque(self) -> JointAngles:
        """Switch the torque on again; return the recorded goals.

        Raises:
            SetupError: The recorded body refused.
        """
        refused = next((one for one in self._records if isinstance(one, TorqueRefused)), None)
        if refused is not None:
            self._records.remove(refused)
            raise SetupError(refused.why)
        goals = self._body.enable_torque()
        said = self._next(TorqueEnabled)
        return said.goals_rad if said is not None else goals

    def _next(self, kind: type[H]) -> H | None:
        """Return the next record of a kind and drop the unread ones before it."""
        if not any(isinstance(one, kind) for one in self._records):
            return None
        while True:
            one = self._records.popleft()
            if isinstance(one, kind):
                return one


class PlaybackPerception(Perception):
    """A perception that returns the recorded percept.

    Attributes:
        percept: The percept to return.
    """

    def __init__(self, mount: CameraMount, horizontal_field_deg: float) -> None:
        super().__init__(mount, horizontal_field_deg)
        self.percept: Percept | None = None

    def see(self, detections: Detections | None, poses: PoseHistory) -> Percept | None:
        """Return the recorded percept."""
        return self.percept


class NoCamera:
    """A camera without frames: the recording contains the percepts."""

    def open(self) -> None:
        """Open nothing."""

    def latest(self, now_s: float) -> Detections | None:
        """Return nothing."""
        return None

    def events(self) -> tuple[str, ...]:
        """Return no events."""
        return ()

    def close(self) -> None:
        """Close nothing."""
