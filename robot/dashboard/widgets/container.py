"""Containers of elements: the panels of the page and their sections."""

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from gazerig.robot.dashboard.widgets.widget import (
    Buttons,
    Chart,
    Checkbox,
    Choice,
    Html,
    Image,
    Slider,
    TextField,
    Widget,
    WidgetPlace,
    WidgetPublisher,
)

W = TypeVar("W", bound=Widget)
Make = Callable[[WidgetPublisher, WidgetPlace, str, dict[str, object]], W]
"""Constructor of a kind of element."""


class Adder(Protocol):
    """Owner of elements that sends them to browsers."""

    def clear(self, parent: str | int) -> None:
        """Remove everything from a panel or section."""

    def add(
        self, make: Make[W], kind: str, where: tuple[str | int, str, str], props: dict[str, object]
    ) -> W:
        """Add an element; where: its parent, its panel, and the client that alone sees it."""


class Container:
    """Container of elements: a panel of the page or a section of one.

    Args:
        page: takes what is added.
        parent: name of the panel, or number of the section.
        panel: name of the panel.
        owner: the client that alone sees what is added, "" for all.
    """

    def __init__(self, page: Adder, parent: str | int, panel: str, owner: str = "") -> None:
        self.page = page
        self._where = (parent, panel, owner)

    def own(self, client: str) -> "Container":
        """Return the same container for elements that only one client sees."""
        return Container(self.page, *self._where[:2], client)

    def clear(self) -> None:
        """Remove all elements."""
        self.page.clear(self._where[0])

    def html(self, content: str = "", *, order: float = 0.0) -> Html:
        """Add a piece of HTML."""
        return self.page.add(Html, "html", self._where, {"content": content, "order": order})

    def section(self, title: str, *, is_open: bool = True, order: float = 0.0) -> "Section":
        """Add a section with a title that can be folded."""
        props: dict[str, object] = {"title": title, "open": is_open, "order": order}
        return Section(self, self.page.add(Widget, "section", self._where, props))

    def image(self, label: str, *, pick: bool = False, order: float = 0.0) -> Image:
        """Add an image, empty at first; label: its description for screen readers.

        pick: a click asks the rig to look at what was clicked
        """
        props: dict[str, object] = {"label": label, "pick": pick, "order": order}
        return self.page.add(Image, "image", self._where, props)

    def chart(
        self,
        title: str,
        lines: Sequence[tuple[str, str]],
        *,
        unit: str = "",
        least: float = 0.0,
        order: float = 0.0,
    ) -> Chart:
        """Add a chart of lines over time.

        Args:
            title: Text above the chart.
            lines: name and style of each; browser/panels.css has a colour for each style.
            unit: of the values.
            least: Smallest range of the axis.
            order: its place among its neighbours.
        """
        props: dict[str, object] = {
            "title": title, "lines": [list(one) for one in lines], "unit": unit, "least": least,
            "x": [], "y": [[] for _ in lines], "order": order,
        }  # fmt: skip
        return self.page.add(Chart, "chart", self._where, props)

    def text(
        self, label: str, value: str = "", *, hint: str = "", on: str = "left", order: float = 0.0
    ) -> TextField:
        """Add a line of text that is sent at Enter, also when the focus leaves, or at each key.

        on: "enter", "left" or "key"
        """
        props: dict[str, object] = {
            "label": label, "value": value, "hint": hint, "on": on, "order": order,
        }  # fmt: skip
        return self.page.add(TextField, "text", self._where, props)

    def slider(
        self,
        label: str,
        ends: tuple[float, float],
        step: float,
        value: float,
        *,
        hint: str = "",
        whole: bool = False,
        order: float = 0.0,
    ) -> Slider:
        """Add a slider between two ends, whose number can also be typed."""
        props: dict[str, object] = {
            "label": label, "low": ends[0], "high": ends[1], "step": step, "value": value,
            "hint": hint, "whole": whole, "order": order,
        }  # fmt: skip
        return self.page.add(Slider, "slider", self._where, props)

    def checkbox(self, label: str, value: bool, *, hint: str = "", order: float = 0.0) -> Checkbox:
        """Add a checkbox."""
        props: dict[str, object] = {"label": label, "value": value, "hint": hint, "order": order}
        return self.page.add(Checkbox, "checkbox", self._where, props)

    def choice(
        self,
        label: str,
        options: Sequence[str],
        value: str = "",
        *,
        hint: str = "",
        order: float = 0.0,
    ) -> Choice:
        """Add a menu; without a value the first option is chosen."""
        props: dict[str, object] = {
            "label": label, "options": list(options), "value": value or options[0], "hint": hint,
            "order": order,
        }  # fmt: skip
        return self.page.add(Choice, "choice", self._where, props)

    def buttons(
        self, label: str, options: Sequence[str], *, hint: str = "", order: float = 0.0
    ) -> Buttons:
        """Add a row of buttons; label: text in front of them, "" for none."""
        props: dict[str, object] = {
            "label": label, "options": list(options), "current": "", "hint": hint, "order": order,
        }  # fmt: skip
        return self.page.add(Buttons, "buttons", self._where, props)


class Section(Container):
    """Part of a panel under a title."""

    def __init__(self, parent: Container, widget: Widget) -> None:
        super().__init__(parent.page, widget.place.number, *widget.place[2:])
        self.widget = widget

    def remove(self) -> None:
        """Remove the section with all that is in it."""
        self.widget.remove()
