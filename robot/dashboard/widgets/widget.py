"""Elements of the page's panels; browsers draw them with native controls.

A change of an element is sent to every browser that shows it. The element checks the input of a
browser before it is applied.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Generic, NamedTuple, Protocol, TypeVar

T = TypeVar("T")

MOST_TEXT = 4000
"""Longest text that a browser may send, characters."""


class WidgetPlace(NamedTuple):
    """Position of an element.

    number: number of the element; parent: name of the panel or number of the section around it
    panel: name of the panel around it, at any depth
    """

    number: int
    parent: str | int
    panel: str


class WidgetPublisher(Protocol):
    """Sender of changes to the browsers; safe to call from any thread."""

    def publish_change(self, widget: "Widget", props: Mapping[str, object], but: str = "") -> None:
        """Send changed properties to all viewers of the element, except one client."""

    def publish_removal(self, widget: "Widget") -> None:
        """Remove an element without children from all browsers."""

    def publish_image(self, widget: "Widget") -> None:
        """Send an element's new image."""


class Widget:
    """Element of a panel.

    place: position of the element; props: properties that are sent to browsers
    """

    def __init__(
        self, page: WidgetPublisher, place: WidgetPlace, kind: str, props: dict[str, object]
    ) -> None:
        self._page, self.place = page, place
        self.props: dict[str, object] = {"kind": kind, "in": place.parent, **props}
        self.data = b""

    def _set(self, but: str = "", **props: object) -> None:
        """Change properties; unchanged ones are not sent."""
        new = {name: value for name, value in props.items() if self.props.get(name) != value}
        if new:
            self.props.update(new)
            self._page.publish_change(self, new, but)

    def _words(self, prop: str) -> tuple[str, ...]:
        """Return a property that is a list of text."""
        words = self.props[prop]
        assert isinstance(words, list)
        return tuple(words)

    def remove(self) -> None:
        """Remove the element from the page."""
        self._page.publish_removal(self)

    def receive_input(self, value: object, client: str) -> None:
        """Apply the input of a browser for this element.

        Raises:
            ValueError: the input is not valid; the message describes valid input.
        """
        raise ValueError("it has no value to set")


class Html(Widget):
    """HTML element; the caller must escape names in it."""

    @property
    def content(self) -> str:
        """Shown HTML; it is sent only if it has changed."""
        return str(self.props["content"])

    @content.setter
    def content(self, content: str) -> None:
        self._set(content=content)


class Image(Widget):
    """JPEG or PNG image."""

    def show(self, data: bytes) -> None:
        """Show another image."""
        if data != self.data:
            self.data = data
            self._page.publish_image(self)


class Chart(Widget):
    """Chart of lines over an axis.

    Its props are title, unit, x (n numbers) and lines. Each line is (name, style, n numbers); the
    style is the name of a colour of the page. Screen readers read the last values.
    """

    def draw(self, x: Sequence[float], lines: Mapping[str, Sequence[float]]) -> None:
        """Replace the lines; x: common to all, lines: name -> values."""
        self._set(x=list(x), y=[list(lines[name]) for name in self.names()])

    def names(self) -> list[str]:
        """Return the names of the lines."""
        lines = self.props["lines"]
        assert isinstance(lines, list)
        return [str(line[0]) for line in lines]

    @property
    def title(self) -> str:
        """Text above the chart."""
        return str(self.props["title"])


class Field(Widget, ABC, Generic[T]):
    """Element with a value that users can change."""

    def __init__(
        self, page: WidgetPublisher, place: WidgetPlace, kind: str, props: dict[str, object]
    ) -> None:
        super().__init__(page, place, kind, props)
        self._handlers: list[Callable[[T, str], object]] = []

    @property
    def value(self) -> T:
        """Value shown in all browsers; setting it calls no handler."""
        return self.props["value"]  # type: ignore[return-value]

    @value.setter
    def value(self, value: T) -> None:
        self._set(value=value)

    @property
    def label(self) -> str:
        """Name of the field."""
        return str(self.props["label"])

    @label.setter
    def label(self, label: str) -> None:
        self._set(label=label)

    def on_change(self, do: Callable[[T, str], object]) -> None:
        """Call ``do`` with the value and the client when a user changes it."""
        self._handlers.append(do)

    @abstractmethod
    def check_value(self, value: object) -> T:
        """Return the input of a browser as a value of this field.

        Raises:
            ValueError: the input is not a valid value.
        """

    def receive_input(self, value: object, client: str) -> None:
        """Apply a value from a browser, show it in the others and call the handlers."""
        taken = self.check_value(value)
        self._set(but=client, value=taken)
        for do in self._handlers:
            do(taken, client)


class Checkbox(Field[bool]):
    """Checkbox."""

    def check_value(self, value: object) -> bool:
        """Return a boolean."""
        if not isinstance(value, bool):
            raise ValueError(f"{self.label} is on or off")
        return value


class TextField(Field[str]):
    """Line of text, sent ``on`` "enter", or also if the focus has "left"."""

    def check_value(self, value: object) -> str:
        """Return a text without control characters."""
        if not isinstance(value, str) or len(value) > MOST_TEXT:
            raise ValueError(f"{self.label} is a text of at most {MOST_TEXT} characters")
        return "".join(letter for letter in value if letter.isprintable())


class Slider(Field[float]):
    """Slider between two ends, whose number can also be typed.

    A typed number is applied at Enter, when the field loses the focus, or by the arrow keys.
    """

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value."""
        low, high = self.props["low"], self.props["high"]
        assert isinstance(low, int | float) and isinstance(high, int | float)
        return low, high

    @ends.setter
    def ends(self, ends: tuple[float, float]) -> None:
        self._set(low=ends[0], high=ends[1])

    def check_value(self, value: object) -> float:
        """Return a number between the ends."""
        low, high = self.ends
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise ValueError(f"{self.label} is a number from {low:g} to {high:g}")
        if not low <= value <= high:
            raise ValueError(f"{self.label} goes from {low:g} to {high:g}; {value:g} is outside")
        return float(value)


class Choice(Field[str]):
    """Menu with one chosen option."""

    @property
    def options(self) -> tuple[str, ...]:
        """Options; if new options do not contain the value, it becomes the first one."""
        return self._words("options")

    @options.setter
    def options(self, options: Sequence[str]) -> None:
        value = self.value if self.value in options else options[0]
        self._set(options=list(options), value=value)

    def check_value(self, value: object) -> str:
        """Return one of the options."""
        if not isinstance(value, str) or value not in self.options:
            raise ValueError(f"{self.label} is one of {', '.join(self.options)}")
        return value


class Buttons(Widget):
    """Row of buttons; one of them may be marked as the present choice."""

    def __init__(
        self, page: WidgetPublisher, place: WidgetPlace, kind: str, props: dict[str, object]
    ) -> None:
        super().__init__(page, place, kind, props)
        self._handlers: list[Callable[[str, str], object]] = []

    @property
    def options(self) -> tuple[str, ...]:
        """Labels of the buttons."""
        return self._words("options")

    @options.setter
    def options(self, options: Sequence[str]) -> None:
        self._set(options=list(options))

    @property
    def current(self) -> str:
        """Button that is marked as the present choice, "" for none."""
        return str(self.props["current"])

    @current.setter
    def current(self, option: str) -> None:
        self._set(current=option)

    def on_press(self, do: Callable[[str, str], object]) -> None:
        """Call ``do`` with the button and the client when one is pressed."""
        self._handlers.append(do)

    def receive_input(self, value: object, client: str) -> None:
        """Handle a press of one of the buttons."""
        if not isinstance(value, str) or value not in self.options:
            raise ValueError(f"there is a button for each of {', '.join(self.options)}")
        for do in self._handlers:
            do(value, client)
