"""Sliders to jog joints within their limits; the other sliders follow their joints."""

from collections.abc import Mapping
from functools import partial
from math import degrees, radians

from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Slider
from gazerig.robot.dashboard.widgets.widgets import Container
from gazerig.robot.model.commands import Jog
from gazerig.robot.model.types import Snapshot, in_order

_STEP_DEG = 0.1
_FIRST, _LAST = 1, 100
"""Order of the sliders and of the elements below them."""
_FOLLOWS_DEG = 0.15
"""Step in which a slider follows its joint, deg."""
_FREE_AFTER_S = 0.5
"""Time after which a joint with another desired angle counts as no longer jogged, s."""
_SAME_DEG = 0.3
ESTIMATED = "estimated from the goals, not measured: the servos give no feedback"


class JogPanel:
    """One slider for each joint; they are created when the limits are known.

    Args:
        place: Container of the sliders.
        outbox: takes commands for the rig.
    """

    def __init__(self, place: Container, outbox: Outbox) -> None:
        self._place, self._outbox = place, outbox
        self.sliders: dict[str, Slider] = {}
        # Joint -> requested angle and the time of the last frame in which it was desired.
        self._held: dict[str, tuple[float, float]] = {}
        self._now_s = 0.0
        place.html(
            note(
                "This moves the joint of the real head slowly, within the guard's limits. All "
                'others hold their angles until you press "look freely".'
            ),
            order=0,
        )
        self.estimated_joints_note = place.html(order=_LAST)

    def let_go(self) -> None:
        """Forget the jogged joints; their sliders follow them again."""
        self._held.clear()

    def values(self, in_force: Mapping[str, object]) -> None:
        """Create the sliders, and set their ranges to the joints' limits."""
        keys = [key.split(".") for key in in_force if key.startswith("joints.")]
        for joint in in_order(path[1] for path in keys if path[2:] == ["min_deg"]):
            low, high = (in_force.get(f"joints.{joint}.{end}_deg") for end in ("min", "max"))
            if not (isinstance(low, int | float) and isinstance(high, int | float)):
                continue
            slider = self.sliders.get(joint)
            if slider is not None:
                slider.ends = (float(low), float(high))
                continue
            slider = self.sliders[joint] = self._place.slider(
                joint.replace("_", " "),
                (float(low), float(high)),
                _STEP_DEG,
                min(max(0.0, float(low)), float(high)),
                hint=(
                    f"moves the joint, slowly; {low:g} to {high:g} deg, + left, up, open, "
                    "right ear down"
                ),
                order=_FIRST + len(self.sliders),
            )
            slider.on_change(partial(self._jog, joint))

    def _jog(self, joint: str, angle_deg: float, who: str) -> None:
        self._held[joint] = (angle_deg, self._now_s)
        self._outbox.command(Jog(((joint, radians(angle_deg)),)), who)

    def show(self, snapshot: Snapshot) -> None:
        """Update the sliders of joints that are not jogged, and list joints without measurement."""
        if snapshot.t_s < self._now_s:  # the rig's clock was restarted
            self._held.clear()
        self._now_s = snapshot.t_s
        places = {joint: i for i, joint in enumerate(snapshot.joints)}
        for joint, slider in self.sliders.items():
            if (i := places.get(joint)) is None:
                continue
            if (held := self._held.get(joint)) is not None:
                asked_deg, at_s = held
                if not snapshot.stopped and (
                    abs(degrees(snapshot.desired_rad[i]) - asked_deg) < _SAME_DEG
                ):
                    self._held[joint] = (asked_deg, self._now_s)
                elif snapshot.stopped or self._now_s - at_s > _FREE_AFTER_S:
                    del self._held[joint]  # a stop or another command has released it
            angle_deg = degrees(snapshot.measured_rad[i])
            if joint not in self._held and abs(slider.value - angle_deg) > _FOLLOWS_DEG:
                low, high = slider.ends
                slider.value = round(min(max(angle_deg, low), high), 1)
        self.estimated_joints_note.content = estimated_joints_note(snapshot)


def estimated_joints_note(snapshot: Snapshot) -> str:
    """Return the joints with estimated angles as HTML, "" if all are measured."""
    estimated = [joint for joint in snapshot.joints if joint in frozenset(snapshot.estimated)]
    if not estimated:
        return ""
    names = "all joints" if len(estimated) == len(snapshot.joints) else ", ".join(estimated)
    return note(f"{names.replace('_', ' ')}: {ESTIMATED}")
