"""All parameters as controls, in every browser its own: a group of them at a time.

A rig has some five hundred parameters. Their controls are built when a group is chosen or
something is searched for, never all: a browser takes seconds to build so many.
"""

import threading
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import cast

import viser

from gazerig.robot.dashboard.outbox import Outbox
from gazerig.robot.dashboard.param_control import ParamControl
from gazerig.robot.dashboard.widget import put
from gazerig.robot.remote.param_info import ParamInfo

MOST_SHOWN = 30
SAVE, REVERT = "save", "revert to the file"
NOTHING, UNSAVED, DIFFERENT = "choose a group ...", "what is not saved", "what differs from default"

_OF_TUNING = ":tuning"
_REFUSED_S = 12.0
_SAID_S = 8.0


class ParamState:
    """The parameters, and one panel of controls for each browser."""

    def __init__(self, server: viser.ViserServer, tab: viser.GuiTabHandle, outbox: Outbox) -> None:
        self._tab = tab
        self._outbox = outbox
        self._params: dict[str, ParamInfo] = {}
        self._panels: dict[str, ParamPanel] = {}
        # A tab takes one builder at a time, and browsers come and go in a thread of their own.
        self._lock = threading.RLock()
        self.in_force: dict[str, object] = {}
        self._unsaved: frozenset[str] = frozenset()
        self._path = ""
        self._clients = server.get_clients
        server.on_client_connect(self._greet)
        server.on_client_disconnect(self._forget)

    async def _greet(self, client: viser.ClientHandle) -> None:
        with self._lock:
            panel = ParamPanel(client, self._tab, self._outbox, self._lock)
            panel.offer(self._params)
            panel.take(self.in_force, self._unsaved, self._path)
            self._panels[str(client.client_id)] = panel

    async def _forget(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._panels.pop(str(client.client_id), None)

    def params(self, params: Sequence[Mapping[str, object]]) -> None:
        """Add parameters that can be tuned."""
        with self._lock:
            for data in params:
                param = ParamInfo.from_json(data)
                self._params[param.key] = param
            for panel in self._panels.values():
                panel.offer(self._params)

    def values(self, state: Mapping[str, object]) -> None:
        """Update changed values, what is not saved, and the file that save would write."""
        with self._lock:
            self.in_force.update(cast(Mapping[str, object], state.get("values", {})))
            self._unsaved = frozenset(cast(Iterable[str], state.get("unsaved", ())))
            self._path = str(state.get("path") or "")
            for panel in self._panels.values():
                panel.take(self.in_force, self._unsaved, self._path)

    def answered(self, who: str, text: str | None) -> None:
        """Pass the rig's answer on to who asked; other messages go to all users."""
        client, _, of_tuning = who.partition(":")
        with self._lock:
            panel = self._panels.get(client)
            if panel is not None and of_tuning:
                panel.answered()
        if not text:
            return
        clients = self._clients()
        asked = [c for c in clients.values() if str(c.client_id) == client]
        for handle in asked or clients.values():
            _notify(handle, text)


class ParamPanel:
    """The controls of one browser."""

    def __init__(
        self,
        client: viser.ClientHandle,
        tab: viser.GuiTabHandle,
        outbox: Outbox,
        lock: threading.RLock,
    ) -> None:
        """Add search, groups and buttons; parameters come when they are chosen."""
        self._client = client
        self._gui = client.gui
        self._tab = tab
        self._outbox = outbox
        self._lock = lock
        self._who = f"{client.client_id}{_OF_TUNING}"
        self._params: Mapping[str, ParamInfo] = {}
        self._values: Mapping[str, object] = {}
        self._unsaved: frozenset[str] = frozenset()
        self._controls: dict[str, ParamControl] = {}
        self._unanswered = 0
        with tab:
            self._build()
        self._listen()

    def _build(self) -> None:
        gui = self._gui
        self._words = gui.add_html(_note("nothing to tune has been named yet"), order=0)
        self._buttons = gui.add_button_group("file", (SAVE, REVERT), order=1)
        self._form = gui.add_form(None, order=2)
        with self._form:
            self._file = gui.add_text(
                "save as", "", hint="a new .yaml file in the rig's folder; Enter saves"
            )
        self._find = gui.add_text("find", "", order=3, hint="words of a key or its meaning")
        self._group = gui.add_dropdown("group", (NOTHING,), order=4)
        self._folder = gui.add_folder("parameters", order=5)
        self._rest = gui.add_html("", order=6)

    def _listen(self) -> None:
        @self._find.on_update
        async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
            if event.client_id is not None:
                self._show_chosen()

        @self._group.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None:
                put(self._find, "")
                self._show_chosen()

        @self._buttons.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            save = {"do": "save", "path": None}
            self._ask(save if event.target.value == SAVE else {"do": "revert"})

        @self._form.on_submit
        async def _(event: viser.GuiEvent[viser.GuiFormHandle]) -> None:
            self._ask({"do": "save", "path": self._file.value.strip() or None})

    def offer(self, params: Mapping[str, ParamInfo]) -> None:
        """Set the parameters that there are."""
        self._params = params
        groups = tuple(dict.fromkeys(group_of(param) for param in params.values()))
        self._group.options = (NOTHING, UNSAVED, DIFFERENT, *groups)

    def take(self, values: Mapping[str, object], unsaved: frozenset[str], path: str) -> None:
        """Update the values in force; a control that is being moved keeps its value."""
        self._values, self._unsaved = values, unsaved
        some = f"<b>● {len(unsaved)} not saved</b>" if unsaved else "all saved"
        text = _note(f"{len(self._params)} parameters, {some}<br>{escape(path)}")
        if self._words.content != text:
            self._words.content = text
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
                    with self._folder:
                        self._controls[key] = self._control(key, control.order)

    def _ask(self, what: Mapping[str, object]) -> None:
        if not self._outbox.ask(what, self._who):
            _notify(self._client, "refused: the rig takes nothing now")
            self._refresh()

    def _put(self, key: str, value: object) -> None:
        with self._lock:
            self._unanswered += 1
            if not self._outbox.ask({"do": "set", "changes": {key: value}}, self._who):
                self._unanswered -= 1
                _notify(self._client, "refused: the rig takes nothing now")
                self._refresh()

    def _refuse(self, text: str) -> None:
        _notify(self._client, f"refused: {text}")
        self._refresh()

    def _show_chosen(self) -> None:
        """Build the controls of what is searched for, or of the chosen group."""
        with self._lock:
            wanted = self._chosen()
            for key in [key for key in self._controls if key not in wanted[:MOST_SHOWN]]:
                self._controls.pop(key).remove()
            with self._folder:
                for place, key in enumerate(wanted[:MOST_SHOWN]):
                    if key not in self._controls:
                        self._controls[key] = self._control(key, float(place))
            more = len(wanted) - MOST_SHOWN
            self._rest.content = _note(f"and {more} more: search for less") if more > 0 else ""

    def _control(self, key: str, place: float) -> ParamControl:
        return ParamControl(
            self._gui,
            self._params[key],
            self._values[key],
            key in self._unsaved,
            self._put,
            self._refuse,
            place,
        )

    def _chosen(self) -> list[str]:
        known = [param for key, param in self._params.items() if key in self._values]
        if self._find.value.strip():
            return found(self._find.value, known)
        match self._group.value:
            case str(name) if name == UNSAVED:
                return [param.key for param in known if param.key in self._unsaved]
            case str(name) if name == DIFFERENT:
                return [k.key for k in known if self._values[k.key] != k.default]
            case group:
                return [param.key for param in known if group_of(param) == group]


def group_of(param: ParamInfo) -> str:
    """Return the group a parameter is listed in: as in the file, two names deep."""
    return ".".join(param.group.split(".")[:2]) if param.group else "rig"


def found(text: str, params: Iterable[ParamInfo]) -> list[str]:
    """Return the keys in which, with what they mean, every word of a text occurs."""
    words = text.lower().split()
    return [
        param.key
        for param in params
        if all(word in f"{param.key} {param.description} {param.unit}".lower() for word in words)
    ]


def _notify(client: viser.ClientHandle, text: str) -> None:
    refused = text.startswith("refused")
    client.add_notification(
        "refused" if refused else "the rig says",
        text.removeprefix("refused: "),
        color="red" if refused else "blue",
        auto_close_seconds=_REFUSED_S if refused else _SAID_S,
    )


def _note(html: str) -> str:
    return (
        "<div style='padding:4px 12px;font-size:12px;opacity:.85;overflow-wrap:anywhere'>"
        f"{html}</div>"
    )
