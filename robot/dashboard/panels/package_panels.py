"""Panels that packages add to the page, by entry points of the group ``gazerig.page_panel``."""

from abc import ABC, abstractmethod

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import PAGE_PANEL, describe_error, registrations
from gazerig.robot.dashboard.widgets.container import Container
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Html
from gazerig.robot.model.types import Snapshot

_LAST = 8.0
"""Order of these sections: after ours."""


class PagePanel(ABC):
    """A section of the page's drawer Watch; an entry point names a subclass.

    It is made without arguments in the page's process, and again when a run starts again.

    Attributes:
        title: of the section.
    """

    title = ""

    @abstractmethod
    def update(self, snapshot: Snapshot) -> None:
        """Add a snapshot of the rig; called with each, also with those that nobody sees."""

    @abstractmethod
    def drawing(self) -> str:
        """Return the section as HTML, without scripts; called about once a second."""


class PackagePanels:
    """The panels of all packages, made by ``begin``; one that fails shows why and is dropped."""

    def __init__(self, place: Container) -> None:
        self._shown: list[tuple[type[PagePanel], Html]] = []
        for one in registrations(PAGE_PANEL):
            try:
                part = one.load()
                if not (isinstance(part, type) and issubclass(part, PagePanel)):
                    raise PluginError(f"{one.label} is no subclass of PagePanel")
            except PluginError as error:
                place.section(one.name, order=_LAST).html(note(str(error)))
                continue
            section = place.section(part.title or one.name, is_open=False, order=_LAST)
            self._shown.append((part, section.html()))
        self._panels: dict[Html, PagePanel] = {}

    def begin(self) -> None:
        """Start all panels from nothing."""
        self._panels = {}
        for part, html in self._shown:
            try:
                self._panels[html] = part()
            except Exception as error:  # a package's code may do anything
                html.content = note(f"the panel has failed: {describe_error(error)}")

    def update(self, snapshot: Snapshot) -> None:
        """Give a snapshot to all panels."""
        for html, panel in list(self._panels.items()):
            try:
                panel.update(snapshot)
            except Exception as error:
                self._drop(html, error)

    def draw(self) -> None:
        """Draw all panels."""
        for html, panel in list(self._panels.items()):
            try:
                html.content = str(panel.drawing())
            except Exception as error:
                self._drop(html, error)

    def _drop(self, html: Html, error: Exception) -> None:
        del self._panels[html]
        html.content = note(f"the panel has failed: {describe_error(error)}")
