"""Parameters as controls, separately in each browser, one group at a time.

A rig has some five hundred parameters. Their controls are built when a group is chosen or
it is searched for, never all: a browser takes seconds to build all of them.
"""

import threading
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import cast

from gazerig.robot.dashboard.panels.param_control import ParamControl
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.parameter import Parameter

MOST_SHOWN = 30
SAVE, REVERT = "save", "revert to the file"
NOTHING, UNSAVED, DIFFERENT = "choose a group ...", "what is not saved", "what differs from default"

_OF_TUNING = ":tuning"
_NO_TAKER = "the rig accepts no requests now"
_SAVE: dict[str, object] = {"do": "save", "path": None}
_REVERT: dict[str, object] = {"do": "revert"}


class ParamState:
    """Parameters, and one panel of controls for each browser."""

    def __init__(self, widgets: Widgets, place: Container, outbox: Outbox) -> None:
        self._widgets, self._place, self._outbox = widgets, place, outbox
        self._params: dict[str, Parameter] = {}
        self._panels: dict[str, ParamPanel] = {}
        # Input, and browsers that connect and disconnect, are handled in a separate thread.
        self._lock = threading.RLock()
        self.in_force: dict[str, object] = {}
        self._unsaved: frozenset[str] = frozenset()
        self._path = ""
        self._over = False
        widgets.on_join(self._greet)
        widgets.on_leave(self._forget)

    def leave(self) -> None:
        """Remove all parameters."""
        with self._lock:
            self._over = True
            self._panels.clear()

    def _greet(self, client: str) -> None:
        with self._lock:
            if self._over:
                return
            panel = ParamPanel(self._widgets, client, self._place, self._outbox, self._lock)
            panel.offer(self._params)
            panel.take(self.in_force, self._unsaved, self._path)
            self._panels[client] = panel

    def _forget(self, client: str) -> None:
        with self._lock:
            self._panels.pop(client, None)

    def params(self, params: Sequence[Mapping[str, object]]) -> None:
        """Add parameters that can be tuned."""
        with self._lock:
            for data in params:
                param = Parameter.from_json(data)
                self._params[param.key] = param
            for panel in self._panels.values():
                panel.offer(self._params)

    def values(self, state: Mapping[str, object]) -> None:
        """Update changed values, unsaved values, and the file that save would write."""
        with self._lock:
            self.in_force.update(cast(Mapping[str, object], state.get("values", {})))
            self._unsaved = frozenset(cast(Iterable[str], state.get("unsaved", ())))
            self._path = str(state.get("path") or "")
            for panel in self._panels.values():
                panel.take(self.in_force, self._unsaved, self._path)

    def answered(self, who: str) -> None:
        """Record that the rig has answered a browser's change."""
        client, _, of_tuning = who.partition(":")
        with self._lock:
            panel = self._panels.get(client)
            if panel is not None and of_tuning:
                panel.answered()


class ParamPanel:
    """Controls of one browser, built when a group is chosen.

    Args:
        widgets: all panels.
        client: the browser's tab.
        place: Container of the controls.
        outbox: takes requests for the rig.
        lock: held by who changes the panels.
    """

    def __init__(
        self,
        widgets: Widgets,
        client: str,
        place: Container,
        outbox: Outbox,
        lock: threading.RLock,
    ) -> None:
        self._widgets, self._client = widgets, client
        self._outbox = outbox
        self._lock = lock
        self._who = f"{client}{_OF_TUNING}"
        self._params: Mapping[str, Parameter] = {}
        self._values: Mapping[str, object] = {}
        self._unsaved: frozenset[str] = frozenset()
        self._controls: dict[str, ParamControl] = {}
        self._unanswered = self._known = 0
        place = place.own(client)
        self._find = place.text("find", on="key", hint="words of a key or its meaning", order=1)
        self._group = place.choice("group", (NOTHING,), order=2)
        self._found = place.section("parameters", order=3)
        self._rest = place.html(order=4)
        self._words = place.html(note("no parameters have been received yet"), order=0)
        self._buttons = place.buttons("", (SAVE, REVERT), order=0.5)
        self._file = place.text(
            "save as", on="enter", hint="a new .yaml file in the rig's folder; Enter saves", order=5
        )
        self._find.on_change(lambda text, _: self._show_chosen())
        self._group.on_change(lambda group, _: self._choose())
        self._buttons.on_press(lambda button, _: self._ask(_SAVE if button == SAVE else _REVERT))
        self._file.on_change(
            lambda path, _: self._ask({"do": "save", "path": path.strip() or None})
        )

    def _choose(self) -> None:
        self._find.value = ""
        self._show_chosen()

    def offer(self, params: Mapping[str, Parameter]) -> None:
        """Set the available parameters."""
        self._params = params
        groups = tuple(dict.fromkeys(group_of(param) for param in params.values()))
        self._group.options = (NOTHING, UNSAVED, DIFFERENT, *groups)

    def take(self, values: Mapping[str, object], unsaved: frozenset[str], path: str) -> None:
        """Update the present values; a control that is being moved keeps its value."""
        self._values, self._unsaved = values, unsaved
        some = f"<b>● {len(unsaved)} not saved</b>" if unsaved else "all saved"
        self._words.content = (
            f"<div>{len(self._params)} parameters, {some}</div><div>{escape(path)}</div>"
        )
        if len(values) != self._known:  # the first arrive after the browser
            self._known = len(values)
            self._show_chosen()
        if not self._unanswered:
            self._refresh()

    def answered(self) -> None:
        """Record that the rig has applied or refused a change."""
        self._unanswered = max(0, self._unanswered - 1)
        if not self._unanswered:
            self._refresh()

    def _refresh(self) -> None:
        with self._lock:
            for key, control in list(self._controls.items()):
                if control.can_show(self._values[key]):
                    control.show(self._values[key], key in self._unsaved)
                else:
                    control.remove()
                    self._controls[key] = self._control(key, control.order)

    def _ask(self, what: Mapping[str, object]) -> None:
        if not self._outbox.ask(what, self._who):
            self._say(_NO_TAKER)
            self._refresh()

    def _put(self, key: str, value: object) -> None:
        with self._lock:
            self._unanswered += 1
            if not self._outbox.ask({"do": "set", "changes": {key: value}}, self._who):
                self._unanswered -= 1
                self._say(_NO_TAKER)
                self._refresh()

    def _refuse(self, text: str) -> None:
        self._say(text)
        self._refresh()

    def _say(self, refusal: str) -> None:
        self._widgets.notify(refusal, self._client, refused=True)

    def _show_chosen(self) -> None:
        """Build the controls of the search result or of the chosen group."""
        with self._lock:
            known = [param for key, param in self._params.items() if key in self._values]
            group = self._group.value
            if self._find.value.strip():
                wanted = found(self._find.value, known)
            elif group == UNSAVED:
                wanted = [param.key for param in known if param.key in self._unsaved]
            elif group == DIFFERENT:
                wanted = [one.key for one in known if self._values[one.key] != one.default]
            else:
                wanted = [param.key for param in known if group_of(param) == group]
            for key in [key for key in self._controls if key not in wanted[:MOST_SHOWN]]:
                self._controls.pop(key).remove()
            for order, key in enumerate(wanted[:MOST_SHOWN]):
                if key not in self._controls:
                    self._controls[key] = self._control(key, float(order))
            more = len(wanted) - MOST_SHOWN
            self._rest.content = note(f"and {more} more: search for less") if more > 0 else ""

    def _control(self, key: str, place: float) -> ParamControl:
        return ParamControl(
            self._found,
            self._params[key],
            self._values[key],
            key in self._unsaved,
            self._put,
            self._refuse,
            place,
        )


def group_of(param: Parameter) -> str:
    """Return the group of a parameter: its section of the file, at most two names deep."""
    return ".".join(param.group.split(".")[:2]) if param.group else "rig"


def found(text: str, params: Iterable[Parameter]) -> list[str]:
    """Return the keys that contain, with description and unit, every word of a text."""
    words = text.lower().split()
    return [
        param.key
        for param in params
        if all(word in f"{param.key} {param.description} {param.unit}".lower() for word in words)
    ]
