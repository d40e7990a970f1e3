"""What moves the face on the page: a button for each expression, and how strong it is."""

from collections.abc import Sequence

import viser

from gazerig.gaze.expression import NEUTRAL
from gazerig.robot.dashboard.outbox import Outbox
from gazerig.robot.model.commands import Express

EXPRESSION = "expression"
"""The menu of this name is shown here."""


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

    def offer(self, names: Sequence[str]) -> None:
        """Show a button for each expression, in place of those before."""
        if self._tab is None:
            self._tab = self._window.add_tab("face")
        if self._expressions is not None:
            self._expressions.remove()
        with self._tab:
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


def _neutral_first(name: str) -> tuple[bool, str]:
    return name != NEUTRAL, name
