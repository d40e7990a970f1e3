"""Panels of packages on the page: functions that return HTML.

A package registers a function behind an entry point of the group ``gazerig.page_panel``. It gets
the state of the head and returns HTML without scripts, for a section of the drawer Watch.
"""

from html import escape
from typing import Any

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import PAGE_PANEL, describe_error, registrations
from gazerig.robot.control.head_state import HeadState
from gazerig.robot.remote.topics import PanelContent


class PackagePanels:
    """The panels of all packages; one that raises an exception shows the reason and is dropped."""

    def __init__(self) -> None:
        self._panels: dict[str, Any] = {}
        self._failed: list[PanelContent] = []
        for one in registrations(PAGE_PANEL):
            try:
                self._panels[one.name] = one.load()
            except PluginError as error:
                self._failed.append(PanelContent(one.name, escape(str(error))))

    def draw(self, state: HeadState) -> tuple[PanelContent, ...]:
        """Return the contents of all panels."""
        failed, self._failed = self._failed, []
        contents = failed
        for title, panel in tuple(self._panels.items()):
            try:
                html = str(panel(state))
            except Exception as error:  # code of a package may raise anything
                del self._panels[title]
                html = f"the panel has failed: {escape(describe_error(error))}"
            contents.append(PanelContent(title, html))
        return tuple(contents)
