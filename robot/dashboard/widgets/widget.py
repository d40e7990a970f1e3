"""The elements of the page's panels, as this program holds them; browsers draw them natively.

A change of an element goes to every browser that shows it. What a browser sends is checked by the
element before it counts.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Generic, NamedTuple, Protocol, TypeVar

T = TypeVar("T")

MOST_TEXT = 4000
"""Characters of a text that a browser may send."""


class WidgetPlace(NamedTuple):
    """Where an element stands.

    number: its own; parent: name of the panel or number of the section that holds it
    panel: name of the panel that it is in, at whatever depth
    owner: the client that alone sees it, "" for all
    """

    number: int
    parent: str | int
    panel: str
    owner: str = ""


class WidgetPublisher(Protocol):
    """Sends changes to the browsers; from any thread."""

    def changed(self, widget: "Widget", props: Mapping[str, object], but: str = "") -> None:
        """Send changed properties to all that see the element, except one client."""

    def removed(self, widget: "Widget") -> None:
        """Remove the element, and what stands in it, from all browsers."""

    def image_changed(self, widget: "Widget") -> None:
        """Send an element's new image."""


class Widget:
    """An element of a panel.

    place: where it stands; props: what browsers are told of it
    """

    def __init__(
        self, page: WidgetPublisher, place: WidgetPlace, kind: str, props: dict[str, object]
    ) -> None:
        self._page, self.place = page, place
        self.props: dict[str, object] = {"kind": kind, "in": place.parent, **props}
        self.data = b""

    def _set(self, but: str = "", **props: object) -> None:
        """Change properties; those that are as they were are not sent."""
        new = {name: value for name, value in props.items() if self.props.get(name) != value}
        if new:
            self.props.update(new)
            self._page.changed(self, new, but)

    def _words(self, prop: str) -> tuple[str, ...]:
        """Return a property that is a list of words."""
        words = self.props[prop]
        assert isinstance(words, list)
        return tuple(words)

    def remove(self) -> None:
        """Remove the element from the page."""
        self._page.removed(self)

    def arrived(self, value: object, client: str) -> None:
        """Apply what a browser sends for this element.

        Raises:
            ValueError: nothing can be sent for it, or not this; the message says what can.
        """
        raise ValueError("nothing can be set there")


class Html(Widget):
    """A piece of HTML; names in it must be escaped by who writes it."""

    @property
    def content(self) -> str:
        """What is shown; it is sent only where it differs from what was."""
        return str(self.props["content"])

    @content.setter
    def content(self, content: str) -> None:
        self._set(content=content)


class Image(Widget):
    """An image: JPEG or PNG."""

    def show(self, data: bytes) -> None:
        """Show another image."""
        if data != self.data:
            self.data = data
            self._page.image_changed(self)


class Chart(Widget):
    """Lines over an axis.

    Its props are title, unit, x (n numbers) and lines: (name, style, n numbers) each, where style
    names a colour of the page. A browser that cannot be looked at reads the last values.
    """

    def draw(self, x: Sequence[float], lines: Mapping[str, Sequence[float]]) -> None:
        """Draw lines anew; x: common to all, lines: by name, those of the chart."""
        self._set(x=list(x), y=[list(lines[name]) for name in self.names()])

    def names(self) -> list[str]:
        """Return the names of the lines."""
        lines = self.props["lines"]
        assert isinstance(lines, list)
        return [str(line[0]) for line in lines]

    @property
    def title(self) -> str:
        """What stands above the chart."""
        return str(self.props["title"])


class Field(Widget, ABC, Generic[T]):
    """An element with a value that people can change."""

    def __init__(
        self, page: WidgetPublisher, place: WidgetPlace, kind: str, props: dict[str, object]
    ) -> None:
        super().__init__(page, place, kind, props)
        self._handlers: list[Callable[[T, str], object]] = []

    @property
    def value(self) -> T:
        """The value shown in all browsers; setting it calls no handler."""
        return self.props["value"]  # type: ignore[return-value]

    @value.setter
    def value(self, value: T) -> None:
        self._set(value=value)

    @property
    def label(self) -> str:
        """The name of the field."""
        return str(self.props["label"])

    @label.setter
    def label(self, label: str) -> None:
        self._set(label=label)

    def on_change(self, do: Callable[[T, str], object]) -> None:
        """Call ``do`` with the value and the client whenever a person changes it."""
        self._handlers.append(do)

    @abstractmethod
    def checked(self, value: object) -> T:
        """Return what a browser sent as a value of this field.

        Raises:
            ValueError: it is none.
        """

    def arrived(self, value: object, client: str) -> None:
        """Apply a value from a browser, show it in the others and call the handlers."""
        taken = self.checked(value)
        self._set(but=client, value=taken)
        for do in self._handlers:
            do(taken, client)


class Checkbox(Field[bool]):
    """A box to tick."""

    def checked(self, value: object) -> bool:
        """Return a boolean."""
        if not isinstance(value, bool):
            raise ValueError(f"{self.label} is on or off")
        return value


class TextField(Field[str]):
    """A line of text; ``on`` says when it counts: at "enter", when "left" too, or by each "key"."""

    def checked(self, value: object) -> str:
        """Return a text without control characters."""
        if not isinstance(value, str) or len(value) > MOST_TEXT:
            raise ValueError(f"{self.label} is a text of at most {MOST_TEXT} characters")
        return "".join(letter for letter in value if letter.isprintable())


class Slider(Field[float]):
    """A number between two ends: to drag, or to type.

    A number that is typed counts at Enter, when its field is left, or by the arrow keys.
    """

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest value."""
        low, high = self.props["low"], self.props["high"]
        assert isinstance(low, int | float) and isinstance(high, int | float)
        return low, high

    @ends.setter
    def ends(self, ends: tuple[float, float]) -> None:
        self._set(low=ends[0], high=ends[1])

    def checked(self, value: object) -> float:
        """Return a number between the ends, whole where the slider is."""
        low, high = self.ends
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise ValueError(f"{self.label} is a number from {low:g} to {high:g}")
        if not low <= value <= high:
            raise ValueError(f"{self.label} goes from {low:g} to {high:g}; {value:g} is outside")
        if self.props["whole"]:
            if value != int(value):
                raise ValueError(f"{self.label} is a whole number")
            return int(value)
        return float(value)


class Choice(Field[str]):
    """A menu of which one is chosen."""

    @property
    def options(self) -> tuple[str, ...]:
        """What there is to choose from; a value that is no longer there becomes the first."""
        return self._words("options")

    @options.setter
    def options(self, options: Sequence[str]) -> None:
        value = self.value if self.value in options else options[0]
        self._set(options=list(options), value=value)

    def checked(self, value: object) -> str:
        """Return one of the options."""
        if not isinstance(value, str) or value not in self.options:
            raise ValueError(f"{self.label} is one of {', '.join(self.options)}")
        return value


class Buttons(Widget):
    """A row of buttons; one of them may be marked as in force."""

    def __init__(
        self, page: WidgetPublisher, place: WidgetPlace, kind: str, props: dict[str, object]
    ) -> None:
        super().__init__(page, place, kind, props)
        self._handlers: list[Callable[[str, str], object]] = []

    @property
    def options(self) -> tuple[str, ...]:
        """What the buttons say."""
        return self._words("options")

    @options.setter
    def options(self, options: Sequence[str]) -> None:
        self._set(options=list(options))

    @property
    def current(self) -> str:
        """The button that is marked as in force, "" for none."""
        return str(self.props["current"])

    @current.setter
    def current(self, option: str) -> None:
        self._set(current=option)

    def on_press(self, do: Callable[[str, str], object]) -> None:
        """Call ``do`` with the button and the client whenever one is pressed."""
        self._handlers.append(do)

    def arrived(self, value: object, client: str) -> None:
        """Handle a press of one of the buttons."""
        if not isinstance(value, str) or value not in self.options:
            raise ValueError(f"there is a button for each of {', '.join(self.options)}")
        for do in self._handlers:
            do(value, client)
