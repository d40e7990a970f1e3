"""What moves the face on the page: a button for each expression and for each gesture."""

from collections.abc import Sequence

import viser

from gazerig.gaze.expression import NEUTRAL
from gazerig.robot.dashboard.outbox import Outbox
from gazerig.robot.model.commands import NO_GESTURE, Express, Play

EXPRESSION = "expression"
GESTURE = "gesture"
"""The menus of these names are shown here."""
_SPEEDS = (0.5, 2.0, 0.1, 1.0)
"""Slowest, fastest, step and first speed of gestures."""


class AnimationPanel:
    """A tab of the controls; it appears when the rig offers something for it.

    Args:
        gui: of the page.
        window: where the tab is added.
        outbox: takes commands for the rig.
    """

    def __init__(self, gui: viser.GuiApi, window: viser.PanelHandle, outbox: Outbox) -> None:
        self._gui, self._window, self._outbox = gui, window, outbox
        self._tab: viser.GuiTabHandle | None = None
        self._expressions: viser.GuiButtonGroupHandle | None = None
        self._strength: viser.GuiSliderHandle[float] | None = None
        self._gestures: viser.GuiButtonGroupHandle | None = None
        self._speed: viser.GuiSliderHandle[float] | None = None

    def offer(self, names: Sequence[str]) -> None:
        """Show a button for each expression, in place of those before."""
        if self._expressions is not None:
            self._expressions.remove()
        with self._shown():
            if self._strength is None:
                self._strength = self._gui.add_slider("strength", 0.0, 1.0, 0.05, 1.0, order=2)
            group = self._gui.add_button_group(
                EXPRESSION, tuple(sorted(names, key=_neutral_first)), order=1
            )
        strength = self._strength

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            chosen = Express(str(event.target.value), float(strength.value))
            self._outbox.command(chosen, str(event.client_id))

        self._expressions = group

    def offer_gestures(self, names: Sequence[str]) -> None:
        """Show a button for each gesture, in place of those before; the first ends them.

        Args:
            names: gestures that the rig can do, and the name that ends the one under way.
        """
        if self._gestures is not None:
            self._gestures.remove()
        with self._shown():
            if self._speed is None:
                self._speed = self._gui.add_slider("speed", *_SPEEDS, order=4)
            group = self._gui.add_button_group(
                GESTURE, tuple(sorted(names, key=lambda name: (name != NO_GESTURE, name))), order=3
            )
        speed = self._speed

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            name, who = str(event.target.value), str(event.client_id)
            self._outbox.command(Play("" if name == NO_GESTURE else name, float(speed.value)), who)

        self._gestures = group

    def _shown(self) -> viser.GuiTabHandle:
        """Return the tab, which is there once something is offered."""
        if self._tab is None:
            self._tab = self._window.add_tab("face")
        return self._tab


def _neutral_first(name: str) -> tuple[bool, str]:
    return name != NEUTRAL, name
