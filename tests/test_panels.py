"""The page's panels: what browsers are sent, what they may send, and who is sent what."""

import json
from typing import Any

import pytest

from gazerig.robot.dashboard.widgets.widgets import Client, Widgets


class Tab:
    """A browser's tab without the drawing."""

    def __init__(self, widgets: Widgets, browser: str = "browser 1") -> None:
        self._widgets = widgets
        self.woken = 0
        self.client: Client = widgets.join(browser, self._wake)
        self.images: dict[int, bytes] = {}
        self.seen: dict[int, dict[str, Any]] = {}
        self.notices: list[tuple[str, bool]] = []

    def _wake(self) -> None:
        self.woken += 1

    def read(self) -> list[int]:
        """Take what waits; the numbers of what was put."""
        out = self._widgets.outgoing(self.client)
        if out is None:
            return []
        for one in out.images:
            self.images[int.from_bytes(one[:4], "big")] = one[4:]
        said = json.loads(out.text) if out.text else {}
        for number, props in said.get("put", []):
            self.seen.setdefault(number, {}).update(props)
        for number in said.get("gone", []):
            self.seen.pop(number, None)
        self.notices += [(one["text"], one["refused"]) for one in said.get("say", [])]
        return [number for number, _ in said.get("put", [])]

    def send(self, *message: object) -> None:
        self._widgets.handle_message(self.client, json.dumps(message[0]))


@pytest.fixture
def widgets() -> Widgets:
    return Widgets()


def test_who_comes_late_gets_all_and_then_what_changed(widgets: Widgets) -> None:
    words = widgets.panel("watch").html("first")
    section = widgets.panel("steer").section("joints")
    slider = section.slider("neck", (-10.0, 10.0), 0.1, 0.0)
    tab = Tab(widgets)
    assert tab.read() == [1, 2, 3]
    assert tab.seen[3]["in"] == 2 and tab.seen[3]["kind"] == "slider"
    assert tab.read() == []
    words.content = "second"
    slider.value = 4.0
    words.content = "third"
    assert tab.read() == [1, 3]
    assert (tab.seen[1]["content"], tab.seen[3]["value"]) == ("third", 4.0)
    words.content = "third"
    assert tab.read() == []


def test_a_slow_browser_gets_only_the_newest_of_each(widgets: Widgets) -> None:
    words, image = widgets.panel("watch").html(), widgets.panel("camera").image("camera")
    tab = Tab(widgets)
    tab.read()
    for k in range(1000):
        words.content = f"words {k}"
        image.show(b"image %d" % k)
    assert len(tab.client.changes) == 1 and len(tab.client.images) == 1
    assert tab.woken == 2  # once for all that waits
    tab.read()
    assert tab.seen[1]["content"] == "words 999" and tab.images == {2: b"image 999"}


def test_a_drawer_that_is_shut_is_not_sent_until_it_is_opened(widgets: Widgets) -> None:
    camera = widgets.panel("camera").image("camera")
    words = widgets.panel("health").html("guard: ok")
    tab = Tab(widgets)
    tab.send({"seen": ["camera"]})
    assert widgets.is_visible("camera") and not widgets.is_visible("health")
    assert tab.read() == [1]
    words.content = "guard: hold"
    camera.show(b"jpeg")
    assert tab.read() == [] and tab.images == {1: b"jpeg"}
    tab.send({"seen": ["camera", "health"]})
    assert tab.read() == [2] and tab.seen[2]["content"] == "guard: hold"


def test_what_one_does_the_others_see_and_handlers_hear_once(widgets: Widgets) -> None:
    heard: list[tuple[float, str]] = []
    slider = widgets.panel("steer").slider("neck", (-10.0, 10.0), 0.1, 0.0)
    slider.on_change(lambda value, client: heard.append((value, client)))
    one, other = Tab(widgets), Tab(widgets)
    one.read(), other.read()
    one.send({"set": [1, 2.5]})
    assert heard == [(2.5, one.client.name)] and slider.value == 2.5
    assert one.read() == [] and other.read() == [1]
    slider.value = 3.0  # set by the program: no handler is called
    assert len(heard) == 1 and one.read() == [1]
    slider.value = 4.0  # older than what the browser sends before it reads
    one.send({"set": [1, 5.0]})
    one.read(), other.read()
    assert (one.seen[1]["value"], other.seen[1]["value"]) == (3.0, 5.0)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        ("slider", [99.0, "1", None, True, [1], 1e400]),
        ("checkbox", [1, "yes", None]),
        ("text", [1, None, "x" * 5000]),
        ("choice", ["c", 1, None]),
    ],
)
def test_what_a_field_cannot_hold_is_refused_in_words(
    widgets: Widgets, kind: str, wrong: list[object]
) -> None:
    place = widgets.panel("steer")
    heard: list[object] = []
    made: dict[str, Any] = {
        "slider": lambda: place.slider("neck", (-10.0, 10.0), 0.1, 1.0),
        "checkbox": lambda: place.checkbox("drag", value=False),
        "text": lambda: place.text("find", "neck"),
        "choice": lambda: place.choice("group", ("a", "b")),
    }
    field = made[kind]()
    for name in ("on_change", "on_press"):
        if hasattr(field, name):
            getattr(field, name)(lambda *given: heard.append(given))
    before = field.props.get("value")
    tab = Tab(widgets)
    tab.read()
    for value in wrong:
        tab.send({"set": [1, value]})
    tab.read()
    assert heard == [] and field.props.get("value") == before
    assert len(tab.notices) == len(wrong) and all(refused for _, refused in tab.notices)
    assert tab.seen[1].get("value") == before  # the browser gets the present value


@pytest.mark.parametrize(
    "text",
    ["no JSON", "[]", "{}", '{"set": 3}', '{"set": [true, 1]}', '{"set": ["1", 1]}', "NaN",
     '{"set": [1, NaN]}', '{"seen": ["nowhere"]}', '{"seen": "watch"}', "[" * 9000],
)  # fmt: skip
def test_nonsense_is_refused_and_changes_nothing(widgets: Widgets, text: str) -> None:
    slider = widgets.panel("steer").slider("neck", (-10.0, 10.0), 0.1, 0.0)
    tab = Tab(widgets)
    tab.read()
    widgets.handle_message(tab.client, text)
    assert slider.value == 0.0 and tab.client.seen >= {"steer", "watch"}
    tab.read()
    assert len(tab.notices) == 1 and tab.notices[0][1]
