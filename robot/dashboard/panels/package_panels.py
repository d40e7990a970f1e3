"""Panels of the drawer Watch, each in one file.

A panel is a subclass of ``PagePanel``, in a module of this folder or behind an entry point of the
group ``gazerig.page_panel``.
"""

import inspect
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import PAGE_PANEL, describe_error, registrations
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Html
from gazerig.robot.dashboard.widgets.widgets import Container
from gazerig.robot.model.types import Snapshot


class PagePanel(ABC):
    """A section of the page's drawer Watch.

    The page's process constructs it without arguments, once more whenever a run restarts.

    Attributes:
        title: Title of the section.
        order: Position in the drawer; sections with a higher number are lower.
        is_open: Whether the section is unfolded at first.
        period: Frames of the page between two drawings; the page has at most 25 a second.
    """

    title = ""
    order = 8.0
    is_open = False
    period = 25

    @abstractmethod
    def update(self, snapshot: Snapshot) -> None:
        """Add a snapshot of the rig; called with every snapshot, also while no browser is open."""

    @abstractmethod
    def drawing(self) -> str:
        """Return the section as HTML without scripts; called once every ``period`` frames."""


def core_panels() -> Iterator[type[PagePanel]]:
    """Return the panels of this folder."""
    package = __name__.rpartition(".")[0]
    for found in pkgutil.iter_modules([str(Path(__file__).parent)]):
        module = import_module(f"{package}.{found.name}")
        for part in vars(module).values():
            ours = inspect.isclass(part) and part.__module__ == module.__name__
            if ours and issubclass(part, PagePanel) and not inspect.isabstract(part):
                yield part


class PagePanels:
    """All panels of the drawer Watch; ``begin`` constructs them.

    A panel that raises an exception shows the reason and is dropped.
    """

    def __init__(self, place: Container) -> None:
        self._shown: list[tuple[type[PagePanel], Html]] = []
        self._panels: dict[Html, PagePanel] = {}
        for part in core_panels():
            self._add(part, part.title, place)
        for one in registrations(PAGE_PANEL):
            try:
                loaded = one.load()
                if not (isinstance(loaded, type) and issubclass(loaded, PagePanel)):
                    raise PluginError(f"{one.label} is no subclass of PagePanel")
            except PluginError as error:
                place.section(one.name, order=PagePanel.order).html(note(str(error)))
            else:
                self._add(loaded, loaded.title or one.name, place)

    def _add(self, part: type[PagePanel], title: str, place: Container) -> None:
        section = place.section(title, is_open=part.is_open, order=part.order)
        self._shown.append((part, section.html()))

    def begin(self) -> None:
        """Construct all panels, without data."""
        self._panels = {}
        for part, html in self._shown:
            try:
                self._panels[html] = part()
            except Exception as error:  # code of a package may raise anything
                html.content = note(f"the panel has failed: {describe_error(error)}")

    def update(self, snapshot: Snapshot) -> None:
        """Add a snapshot to all panels."""
        for html, panel in list(self._panels.items()):
            try:
                panel.update(snapshot)
            except Exception as error:
                self._drop(html, error)

    def draw(self, frame: int) -> None:
        """Draw the panels that are due at a frame of the page, all of them at frame 0."""
        for html, panel in list(self._panels.items()):
            try:
                if frame % panel.period == 0:
                    html.content = str(panel.drawing())
            except Exception as error:
                self._drop(html, error)

    def _drop(self, html: Html, error: Exception) -> None:
        del self._panels[html]
        html.content = note(f"the panel has failed: {describe_error(error)}")
