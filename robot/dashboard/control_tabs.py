"""What a person can make the rig do: menus, a target to drag, and what the tabs hold."""

from collections.abc import Mapping, Sequence
from html import escape

import viser

from gazerig.robot.dashboard.animation_panel import EXPRESSION, GESTURE, AnimationPanel
from gazerig.robot.dashboard.jog_panel import JogPanel
from gazerig.robot.dashboard.outbox import Outbox
from gazerig.robot.dashboard.param_panel import ParamState
from gazerig.robot.dashboard.widget import put
from gazerig.robot.model.commands import Ask, LookAt
from gazerig.robot.model.types import Snapshot

STEER = "steer"
"""A menu of this name is the steps of a calibration, not something to ask the robot for."""

_TARGET_SCALE = 0.12


class ControlTabs:
    """Three tabs: lead, joints, tuning; a fourth, face, where the rig has expressions."""

    def __init__(self, server: viser.ViserServer, outbox: Outbox) -> None:
        # A window of its own: below words that grow and shrink, a button would slip away from
        # under the mouse.
        window = server.gui.add_panel()
        lead, joints, tuning = (window.add_tab(name) for name in ("lead", "joints", "tuning"))
        window.dock_below(server.gui.main_panel)
        self._window = window
        self._lead = LeadView(server, lead, outbox)
        self._joints = JogPanel(server.gui, joints, outbox)
        self._tuning = ParamState(server, tuning, outbox)
        self._face = AnimationPanel(server.gui, window, outbox)

    def leave(self) -> None:
        """Remove all controls: a recording cannot be controlled."""
        self._lead.leave()
        self._window.remove()

    def offer(self, menus: Mapping[str, Sequence[str]]) -> None:
        """Add menus, each with what can be chosen from it."""
        for name, choices in menus.items():
            if name == EXPRESSION:
                self._face.offer(choices)
            elif name == GESTURE:
                self._face.offer_gestures(choices)
            else:
                self._lead.offer(name, choices)

    def params(self, params: Sequence[Mapping[str, object]]) -> None:
        """Add parameters that can be tuned, as the rig describes them."""
        self._tuning.params(params)

    def values(self, state: Mapping[str, object]) -> None:
        """Update the values in force: changed values, what is not saved, the file, characters."""
        self._tuning.values(state)
        self._joints.values(self._tuning.in_force)
        characters = state.get("characters")
        if isinstance(characters, list) and characters:
            self._lead.characters(characters, str(state.get("character", "")))

    def show(self, snapshot: Snapshot) -> None:
        """Show what is measured beside what is asked for."""
        self._lead.show(snapshot)
        self._joints.show(snapshot)

    def answered(self, who: str, text: str | None) -> None:
        """Pass the rig's reply to the panel that waits for it."""
        self._tuning.answered(who, text)


class LeadView:
    """Menus, and a target that is dragged through the scene."""

    def __init__(self, server: viser.ViserServer, tab: viser.GuiTabHandle, outbox: Outbox) -> None:
        """Fill the tab; menus and characters follow when the rig names them."""
        self._server = server
        self._tab = tab
        self._outbox = outbox
        self._menus: dict[str, viser.GuiButtonGroupHandle] = {}
        self._characters: viser.GuiButtonGroupHandle | None = None
        self._target_m = (0.8, 0.0, 0.15)
        self._now, self._character, self._led = "", "", ""
        with tab:
            self._words = server.gui.add_html("", order=1)
            self._leader = server.gui.add_html(_leader(""), order=1.5)
            server.gui.add_html(
                _note("Click in the camera image, or drag a target: the head looks there."),
                order=3,
            )
            self._drag = server.gui.add_checkbox("drag a target", False, order=4)
            free = server.gui.add_button("look freely again", order=5, icon=viser.Icon.EYE)
        self._gizmo = server.scene.add_transform_controls(
            "/led",
            scale=_TARGET_SCALE,
            disable_rotations=True,
            depth_test=False,
            position=self._target_m,
            visible=False,
        )
        self._listen(free)

    def leave(self) -> None:
        """Remove the target."""
        self._gizmo.remove()

    def _listen(self, free: viser.GuiButtonHandle) -> None:
        # Coroutines: viser runs these one after the other, plain functions in any order.
        @self._drag.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            self._gizmo.visible = event.target.value
            if event.target.value:
                self._gizmo.position = self._target_m

        @self._gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            x, y, z = map(float, event.target.position)
            if event.client_id is not None and event.phase != "start":
                self._outbox.command(LookAt((x, y, z)), str(event.client_id))

        @free.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            put(self._drag, False)
            self._outbox.command(LookAt(None), str(event.client_id))

    def offer(self, name: str, choices: Sequence[str]) -> None:
        """Add a menu as a row of buttons."""
        if name in self._menus:
            self._menus.pop(name).remove()
        with self._tab:
            group = self._server.gui.add_button_group(name, tuple(choices), order=2)

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            who, choice = str(event.client_id), event.target.value
            if name == STEER:
                self._outbox.ask({"steer": choice}, who)
            else:
                self._outbox.command(Ask(name, choice), who)

        self._menus[name] = group

    def characters(self, names: Sequence[str], present: str) -> None:
        """Add the characters there are, once, and note the present one."""
        self._character = present
        if self._characters is not None:
            return
        with self._tab:
            group = self._server.gui.add_button_group("character", tuple(names), order=2.5)

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            asked = {"do": "character", "name": event.target.value}
            self._outbox.ask(asked, str(event.client_id))

        self._characters = group

    def show(self, snapshot: Snapshot) -> None:
        """Show the values in force; the target to drag starts where the head looks."""
        self._target_m = snapshot.p_world_target_m
        said = {
            "behaviour": snapshot.behaviour,
            "conversation": snapshot.conversation,
            "character": snapshot.character or self._character,
        }
        now = ", ".join(f"{name} <b>{escape(word)}</b>" for name, word in said.items() if word)
        if now != self._now:
            self._now = now
            self._words.content = _note(f"in force: {now}")
        if snapshot.led != self._led:
            self._led = snapshot.led
            self._leader.content = _leader(snapshot.led)


def _leader(led: str) -> str:
    """Show who leads on one line, always present: the buttons below must not move."""
    text = f"led by <b>{escape(led)}</b>" if led else "no client leads"
    cut = "height:1.5em;overflow:hidden;text-overflow:ellipsis;white-space:nowrap"
    return _note(f"<div title='{escape(led)}' style='{cut}'>{text}</div>")


def _note(html: str) -> str:
    return f"<div style='padding:4px 12px;font-size:12.5px;opacity:.85'>{html}</div>"
