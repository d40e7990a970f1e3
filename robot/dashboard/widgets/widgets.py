"""Panels of the page: elements are added here and drawn by browser/widgets.js.

Every browser receives the changes since its last message, but only the newest of each element: a
slow browser misses intermediate values and does not delay other browsers. A browser that shows only
some panels does not receive the others.
"""

import json
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import NamedTuple, TypeVar

import msgspec

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
"""Constructor of one kind of element."""


PANELS = ("headline", "camera", "watch", "steer", "play", "tune", "health")
"""Names of the panels, as in browser/index.html."""
RECEIVED_BYTES = 16_384
"""Longest message of a browser, bytes."""
_NOTICES = 8
_NUMBER_BYTES = 4


class Container:
    """Container of elements: a panel of the page or a section of one.

    Args:
        page: page to which elements are added.
        parent: name of the panel, or number of the section.
        panel: name of the panel.
    """

    def __init__(self, page: "Widgets", parent: str | int, panel: str) -> None:
        self.page = page
        self._where = (parent, panel)

    def html(self, content: str = "", *, order: float = 0.0) -> Html:
        """Add a piece of HTML."""
        return self.page.add(Html, "html", self._where, {"content": content, "order": order})

    def section(self, title: str, *, is_open: bool = True, order: float = 0.0) -> "Container":
        """Add a section with a title that can be folded."""
        props: dict[str, object] = {"title": title, "open": is_open, "order": order}
        widget = self.page.add(Widget, "section", self._where, props)
        return Container(self.page, widget.place.number, widget.place.panel)

    def image(self, label: str, *, pick: bool = False, order: float = 0.0) -> Image:
        """Add an image, empty at first; label: its description for screen readers.

        pick: whether a click makes the rig look at the clicked point
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
            unit: unit of the values.
            least: smallest range of the axis.
            order: its position among its neighbours.
        """
        props: dict[str, object] = {
            "title": title, "lines": [list(one) for one in lines], "unit": unit, "least": least,
            "x": [], "y": [[] for _ in lines], "order": order,
        }  # fmt: skip
        return self.page.add(Chart, "chart", self._where, props)

    def text(
        self, label: str, value: str = "", *, hint: str = "", on: str = "left", order: float = 0.0
    ) -> TextField:
        """Add a text field that is sent at Enter, or also when it loses the focus.

        on: "enter" or "left"
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
        order: float = 0.0,
    ) -> Slider:
        """Add a slider between two ends, whose number can also be typed."""
        props: dict[str, object] = {
            "label": label, "low": ends[0], "high": ends[1], "step": step, "value": value,
            "hint": hint, "order": order,
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


class Notice(NamedTuple):
    """Message for a user that disappears after some seconds."""

    text: str
    refused: bool


class Outgoing(NamedTuple):
    """Next messages to a client: one text message, and one binary message for each image."""

    text: str
    images: tuple[bytes, ...]


class Client:
    """Tab of a browser that shows panels.

    name: unique name, e.g. "panels-3"; browser: name of its browser
    """

    def __init__(self, name: str, browser: str, wake: Callable[[], None]) -> None:
        self.name, self.browser = name, browser
        self._wake = wake
        self.awake = False  # waiting data has been announced but not yet taken
        # Number of an element -> its changed properties, None if it was removed.
        self.changes: dict[int, dict[str, object] | None] = {}
        self.images: set[int] = set()
        self.notices: deque[Notice] = deque(maxlen=_NOTICES)
        self.seen: frozenset[str] = frozenset(PANELS)

    def wake(self) -> None:
        """Announce waiting data, once until it is taken."""
        if not self.awake:
            self.awake = True
            self._wake()


class Widgets:
    """All panels of a page and their clients; safe to call from any thread."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._widgets: dict[int, Widget] = {}
        self._clients: dict[str, Client] = {}
        self._numbers = self._client_numbers = 0
        self._held = 0
        self._on_join: list[Callable[[str], object]] = []

    # --- elements --------------------------------------------------------------------------

    def panel(self, name: str) -> Container:
        """Return the panel with a name, one of PANELS."""
        if name not in PANELS:
            raise ValueError(f"there is no panel {name}; there are {', '.join(PANELS)}")
        return Container(self, name, name)

    def add(
        self, make: Make[W], kind: str, where: tuple[str | int, str], props: dict[str, object]
    ) -> W:
        """Add an element; where: its parent and its panel."""
        with self._lock:
            self._numbers += 1
            widget = make(self, WidgetPlace(self._numbers, *where), kind, props)
            self._widgets[self._numbers] = widget
            self.publish_change(widget, widget.props)
            return widget

    def publish_change(self, widget: Widget, props: Mapping[str, object], but: str = "") -> None:
        """Send changed properties to all viewers of an element, except one client."""
        with self._lock:
            if widget.place.number not in self._widgets:
                return
            for client in self._clients.values():
                if client.name == but:  # what waits for it is older than its own input
                    (client.changes.get(widget.place.number) or {}).pop("value", None)
                    continue
                waiting = client.changes.setdefault(widget.place.number, {})
                assert waiting is not None  # numbers are not reused
                waiting.update(props)
            self._wake()

    def publish_removal(self, widget: Widget) -> None:
        """Remove an element without children."""
        with self._lock:
            if self._widgets.pop(widget.place.number, None) is None:
                return
            for client in self._clients.values():
                client.changes[widget.place.number] = None
                client.images.discard(widget.place.number)
            self._wake()

    def publish_image(self, widget: Widget) -> None:
        """Send an element's new image."""
        with self._lock:
            for client in self._clients.values():
                client.images.add(widget.place.number)
            self._wake()

    @contextmanager
    def hold_changes(self) -> Iterator[None]:
        """Send nothing within the block, so that browsers receive all its changes together."""
        with self._lock:
            self._held += 1
        try:
            yield
        finally:
            with self._lock:
                self._held -= 1
                self._wake()

    def notify(
        self, text: str, client: str = "", browser: str = "", *, refused: bool = False
    ) -> None:
        """Show a message for some seconds to a client, else to a browser, else to all."""
        with self._lock:
            everyone = list(self._clients.values())
            receivers = (
                [one for one in everyone if one.name == client]
                or [one for one in everyone if browser and one.browser == browser]
                or everyone
            )
            for receiver in receivers:
                receiver.notices.append(Notice(text, refused))
            self._wake()

    @property
    def is_watched(self) -> bool:
        """Whether any client is connected."""
        return bool(self._clients)

    def _wake(self) -> None:
        if self._held:
            return
        for client in self._clients.values():
            if client.changes or client.images or client.notices:
                client.wake()

    # --- clients ---------------------------------------------------------------------------

    def on_join(self, do: Callable[[str], object]) -> None:
        """Call ``do`` with the name of every client that connects."""
        self._on_join.append(do)

    def join(self, browser: str, wake: Callable[[], None]) -> Client:
        """Add a client and queue all elements for it; wake: called when data waits."""
        with self._lock:
            self._client_numbers += 1
            client = Client(f"panels-{self._client_numbers}", browser, wake)
            self._clients[client.name] = client
            for number, widget in self._widgets.items():
                client.changes[number] = dict(widget.props)
                if widget.data:
                    client.images.add(number)
        for do in self._on_join:
            do(client.name)
        with self._lock:
            self._wake()
        return client

    def leave(self, client: Client) -> None:
        """Remove a client."""
        with self._lock:
            self._clients.pop(client.name, None)

    def browser(self, client: str) -> str:
        """Return the name of a client's browser, "" if it is not connected."""
        with self._lock:
            found = self._clients.get(client)
            return found.browser if found is not None else ""

    def is_visible(self, panel: str) -> bool:
        """Return whether any client shows a panel now."""
        with self._lock:
            return any(panel in client.seen for client in self._clients.values())

    # --- messages --------------------------------------------------------------------------

    def outgoing(self, client: Client) -> Outgoing | None:
        """Return the next messages to a client, None if there are none."""
        with self._lock:
            client.awake = False
            if self._held:  # the end of the block wakes it again
                return None
            put, gone = [], []
            for number, props in list(client.changes.items()):
                if props is None:
                    gone.append(number)
                elif (widget := self._widgets.get(number)) is None:
                    pass
                elif widget.place.panel in client.seen:
                    put.append((number, props))
                else:
                    continue
                del client.changes[number]
            images = [
                number.to_bytes(_NUMBER_BYTES, "big") + widget.data
                for number in sorted(client.images)
                if (widget := self._widgets.get(number)) and widget.place.panel in client.seen
            ]
            sent = {int.from_bytes(one[:_NUMBER_BYTES], "big") for one in images}
            client.images = {n for n in client.images if n not in sent and n in self._widgets}
            notices = [notice._asdict() for notice in client.notices]
            client.notices.clear()
        if not (put or gone or images or notices):
            return None
        message = {"put": put, "gone": gone, "say": notices}
        text = json.dumps({name: part for name, part in message.items() if part})
        return Outgoing(text if put or gone or notices else "", tuple(images))

    def handle_message(self, client: Client, text: str) -> None:
        """Handle a message of a client: {"set": [number, value]} or {"seen": [names of panels]}.

        Input that is not valid is refused by a message to that client.
        """
        try:
            self._take(client, msgspec.json.decode(text))
        except (ValueError, RecursionError) as error:
            self.notify(str(error), client.name, refused=True)

    def _take(self, client: Client, message: object) -> None:
        match message:
            case {"set": [int() as number, value]} if not isinstance(number, bool):
                with self._lock:
                    widget = self._widgets.get(number)
                # It may just have been removed.
                if widget is None:
                    return
                try:
                    widget.receive_input(value, client.name)
                except ValueError:
                    # Send a client the present value after another one was refused.
                    with self._lock:
                        if (now := client.changes.setdefault(widget.place.number, {})) is not None:
                            now["value"] = widget.props.get("value")
                    raise
            case {"seen": list(names)} if all(name in PANELS for name in names):
                with self._lock:
                    client.seen = frozenset(names)
                    client.wake()
            case _:
                raise ValueError("a browser sends the number of an element and its new value")
