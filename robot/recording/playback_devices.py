"""The machine of a recorded run: gives the models what the real one gave them, in order."""

from collections import deque
from typing import TypeVar

from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Detections
from gazerig.gaze.types import Percept
from gazerig.robot.control.body import Body
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.model.track_params import TrackParams
from gazerig.robot.model.types import JointAngles, JointState
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker
from gazerig.robot.recording.forwarding_body import ForwardingBody
from gazerig.robot.recording.tick_record import (
    BodyRecord,
    MeasuredJoints,
    TickRecord,
    TorqueEnabled,
    TorqueRefused,
)

H = TypeVar("H", bound=BodyRecord)


class PlaybackBody(ForwardingBody):
    """A body that follows commands, and reports what the recorded one reported.

    The body behind it sees every call, so that its bus carries the bytes of the first run.
    """

    def __init__(self, body: Body) -> None:
        super().__init__(body)
        self._moment: TickRecord | None = None
        self._said: deque[BodyRecord] = deque()
        self._newest: JointState | None = None

    def play(self, moment: TickRecord) -> None:
        """Set what is returned until the end of a tick; once for each tick."""
        if moment is not self._moment:
            self._moment = moment
            self._said = deque(
                (*moment.before, MeasuredJoints(moment.tick.t_s, moment.tick.joints))
            )

    def leave_off(self) -> None:
        """Return from now on what the wrapped body returns."""
        self._said.clear()
        self._newest = None

    def start(self) -> JointAngles:
        """Start the body behind; give the recorded goals."""
        goals = self._body.start()
        said = self._next(TorqueEnabled)
        return said.goals_rad if said is not None else goals

    def read(self, t_s: float) -> JointState:
        """Return the recorded joints; a reading more than there were gives the newest again."""
        joints = self._body.read(t_s)
        said = self._next(MeasuredJoints)
        if said is not None:
            self._newest = said.joints
        return self._newest if self._newest is not None else joints

    def enable_torque(self) -> JointAngles:
        """Torque on again; give the recorded goals.

        Raises:
            SetupError: it was refused then.
        """
        refused = next((one for one in self._said if isinstance(one, TorqueRefused)), None)
        if refused is not None:
            self._said.remove(refused)
            raise SetupError(refused.why)
        goals = self._body.enable_torque()
        said = self._next(TorqueEnabled)
        return said.goals_rad if said is not None else goals

    def _next(self, kind: type[H]) -> H | None:
        """Return the next thing of a kind; what comes before it was not asked for."""
        if not any(isinstance(one, kind) for one in self._said):
            return None
        while True:
            one = self._said.popleft()
            if isinstance(one, kind):
                return one


class PlaybackPerception(Perception):
    """Sees what was seen, placed in the world as it was then.

    percept: in force from now on
    """

    def __init__(self, mount: CameraMount, horizontal_field_deg: float) -> None:
        super().__init__(mount, horizontal_field_deg, Tracker(TrackParams()))
        self.percept: Percept | None = None

    def see(self, detections: Detections | None, poses: PoseHistory) -> Percept | None:
        """Return the recorded percept."""
        return self.percept


class NoCamera:
    """A camera that sees nothing: what was seen is known."""

    def open(self) -> None:
        """Start looking."""

    def latest(self, now_s: float) -> Detections | None:
        """Return nothing."""
        return None

    def events(self) -> tuple[str, ...]:
        """Return no events."""
        return ()

    def close(self) -> None:
        """Stop looking."""
