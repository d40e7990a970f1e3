"""Controls of the face: a button for each expression and gesture, and five under the head."""

from collections.abc import Mapping, Sequence

from gazerig.gaze.gesture.expression import NEUTRAL
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.widget import Buttons, Slider
from gazerig.robot.dashboard.widgets.widgets import Container
from gazerig.robot.model.commands import NO_GESTURE, Express, Play

EXPRESSION = "expression"
GESTURE = "gesture"
"""Names of the menus that are shown here."""
_SPEEDS, _SPEED_STEP = (0.5, 2.0), 0.1
"""Slowest and fastest speed of gestures, and its step."""


class AnimationPanel:
    """Section of the controls; it appears when the rig offers expressions or gestures.

    Args:
        place: Container of the section.
        outbox: Sends commands to the rig.
    """

    def __init__(self, place: Container, outbox: Outbox) -> None:
        self._place, self._outbox = place, outbox
        self._section: Container | None = None
        self.expressions: Buttons | None = None
        self.strength: Slider | None = None
        self.gestures: Buttons | None = None
        self.speed: Slider | None = None

    def offer(self, names: Sequence[str]) -> None:
        """Show a button for each expression, instead of the previous ones."""
        options = tuple(sorted(names, key=lambda name: (name != NEUTRAL, name)))
        if self.expressions is not None:
            self.expressions.options = options
            return
        section = self._open_section()
        self.expressions = section.buttons(EXPRESSION, options, order=1)
        strength = self.strength = section.slider("strength", (0.0, 1.0), 0.05, 1.0, order=2)

        def express(name: str, client: str) -> None:
            self._outbox.command(Express(name, float(strength.value)), client)

        self.expressions.on_press(express)

    def offer_gestures(self, names: Sequence[str]) -> None:
        """Show a button for each gesture, instead of the previous ones; the first ends a gesture.

        Args:
            names: Gestures that the rig can play, and the name that ends the present one.
        """
        options = tuple(sorted(names, key=lambda name: (name != NO_GESTURE, name)))
        if self.gestures is not None:
            self.gestures.options = options
            return
        section = self._open_section()
        self.gestures = section.buttons(GESTURE, options, order=3)
        speed = self.speed = section.slider("speed", _SPEEDS, _SPEED_STEP, 1.0, order=4)

        def play(name: str, client: str) -> None:
            gesture = "" if name == NO_GESTURE else name
            self._outbox.command(Play(gesture, float(speed.value)), client)

        self.gestures.on_press(play)

    def _open_section(self) -> Container:
        """Return the section; create it at the first call."""
        if self._section is None:
            self._section = self._place.section("face", order=20)
        return self._section


GESTURES = ("nod", "shake", "surprised", "sleepy")
WINK = "wink"
_WITH_LIDS = ("surprised", "sleepy")
_NO_LIDS = "this rig has no lids"
_NOT_NOW = "not while a calibration is under way"
_NO_JOINTS = "this rig has none of the joints that it moves"


def refused_moves(
    menus: Mapping[str, Sequence[str]], joints: Sequence[str] | None
) -> dict[str, str]:
    """Return button -> reason of the buttons that this rig cannot do.

    Args:
        menus: Menus of the rig; empty before they are received.
        joints: Names of the rig's joints; None before they are known.
    """
    if not menus:
        return {}
    if "gesture" not in menus:
        return dict.fromkeys((*GESTURES, WINK), _NOT_NOW)
    no_lids = joints is not None and not any("lid" in joint for joint in joints)
    refused = {
        name: _NO_LIDS if no_lids and name in _WITH_LIDS else _NO_JOINTS
        for name in GESTURES
        if name not in menus["gesture"]
    }
    return {**refused, WINK: _NO_LIDS} if no_lids else refused
