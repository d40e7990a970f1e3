"""Panels of packages on the page: functions that return HTML.

A package registers a function behind an entry point of the group ``gazerig.page_panel``. It gets
the state of the head and returns HTML without scripts, for a section of the drawer Watch.
"""

from html import escape
from typing import Any

from gazerig.drivers.plugins import PAGE_PANEL, describe_error, registrations
from gazerig.robot.loop.head_state import HeadState
from gazerig.robot.net.topics import PanelContent


class PackagePanels:
    """The panels of all packages; one that raises an exception shows the reason and is dropped."""

    def __init__(self) -> None:
        self._panels = list(registrations(PAGE_PANEL))

    def draw(self, state: HeadState) -> tuple[PanelContent, ...]:
        """Return the contents of all panels."""
        contents = []
        for panel in tuple(self._panels):
            try:
                draw: Any = panel.load()
                html = str(draw(state))
            except Exception as error:  # code of a package may raise anything
                self._panels.remove(panel)
                html = f"the panel has failed: {escape(describe_error(error))}"
            contents.append(PanelContent(panel.name, html))
        return tuple(contents)
