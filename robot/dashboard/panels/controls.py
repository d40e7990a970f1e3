"""Controls of the rig: the drawers Steer and Tune."""

from collections.abc import Callable, Mapping, Sequence

import viser

from gazerig.robot.dashboard.panels.animation_panel import EXPRESSION, GESTURE, AnimationPanel
from gazerig.robot.dashboard.panels.jog_panel import JogPanel
from gazerig.robot.dashboard.panels.param_panel import ParamState
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Buttons
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.commands import Ask, LookAt
from gazerig.robot.model.types import Snapshot

STEER = "steer"
"""Menu of the steps of a calibration, not of requests to the robot."""
BEHAVIOUR, CONVERSATION, CHARACTER = "behaviour", "conversation", "character"

_TARGET_SCALE = 0.12
_DRAG, _FREE = "drag a target", "look freely"


class Controls:
    """Drawers Steer (gaze, behaviours, face, joints) and Tune (parameters)."""

    def __init__(self, widgets: Widgets, scene: viser.SceneApi, outbox: Outbox) -> None:
        self._steer, self._tune = widgets.panel("steer"), widgets.panel("tune")
        self._jog = JogPanel(self._steer.section("joints", order=40), outbox)
        self._lead = LeadPanel(self._steer, scene, outbox, self._jog.let_go)
        self._tuning = ParamState(widgets, self._tune, outbox)
        self._face = AnimationPanel(self._steer, outbox)

    def leave(self) -> None:
        """Remove all controls: a recording cannot be controlled."""
        self._lead.leave()
        self._tuning.leave()
        for place in (self._steer, self._tune):
            place.clear()
            place.html(note("A recording: there is no rig to move or to tune."))

    def offer(self, menus: Mapping[str, Sequence[str]]) -> None:
        """Add menus with their choices."""
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
        """Update the present values: changed and unsaved values, the file, characters."""
        self._tuning.values(state)
        self._jog.values(self._tuning.in_force)
        characters = state.get("characters")
        if isinstance(characters, list) and characters:
            self._lead.characters(characters, str(state.get("character", "")))

    def show(self, snapshot: Snapshot) -> None:
        """Show measured values next to requested ones."""
        self._lead.show(snapshot)
        self._jog.show(snapshot)

    def answered(self, who: str) -> None:
        """Record that the rig has answered a browser's change."""
        self._tuning.answered(who)


class LeadPanel:
    """Controls of the gaze, with a target to drag through the scene, and menus.

    Args:
        place: Container of the drawer.
        scene: Scene of the target.
        outbox: Sends commands to the rig.
        let_go: Called when joints are released.
    """

    def __init__(
        self,
        place: Container,
        scene: viser.SceneApi,
        outbox: Outbox,
        let_go: Callable[[], object],
    ) -> None:
        self._place, self._outbox, self._let_go = place, outbox, let_go
        self.menus: dict[str, Buttons] = {}
        self._behaviours: Container | None = None
        self._target_m = (0.8, 0.0, 0.15)
        self._character = ""
        place.html(
            note("Click in the camera image, or drag a target in the view: the head looks there."),
            order=1,
        )
        self.drag = place.checkbox(_DRAG, value=False, order=2)
        self.free = place.buttons("", (_FREE,), hint="release gaze and joints", order=3)
        self._gizmo = scene.add_transform_controls(
            "/led",
            scale=_TARGET_SCALE,
            disable_rotations=True,
            depth_test=False,
            position=self._target_m,
            visible=False,
        )
        self.drag.on_change(lambda on, _: self._show_target(on))
        self.free.on_press(lambda _, client: self._look_freely(client))

        # A coroutine: viser runs these in order, plain functions in any order.
        @self._gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            x, y, z = map(float, event.target.position)
            if event.client_id is not None and event.phase != "start":
                self._outbox.command(LookAt((x, y, z)), str(event.client_id))

    def leave(self) -> None:
        """Remove the target."""
        self._gizmo.remove()

    def _show_target(self, on: bool) -> None:
        self._gizmo.visible = on
        if on:
            self._gizmo.position = self._target_m

    def _look_freely(self, client: str) -> None:
        self.drag.value = False
        self._show_target(on=False)
        self._let_go()
        self._outbox.command(LookAt(None), client)

    def offer(self, name: str, choices: Sequence[str]) -> None:
        """Add a menu as a row of buttons, or replace its choices."""
        if (before := self.menus.get(name)) is not None:
            before.options = choices
            return
        menu = self._add(name, choices, order=len(self.menus))

        def ask(choice: str, client: str) -> None:
            if name == STEER:
                self._outbox.ask({"steer": choice}, client)
            else:
                self._outbox.command(Ask(name, choice), client)

        menu.on_press(ask)

    def characters(self, names: Sequence[str], present: str) -> None:
        """Add the menu of characters once, and store the present one."""
        self._character = present
        if CHARACTER in self.menus:
            return
        menu = self._add(CHARACTER, names, order=99)
        menu.on_press(
            lambda name, client: self._outbox.ask({"do": "character", "name": name}, client)
        )

    def _add(self, name: str, choices: Sequence[str], order: float) -> Buttons:
        if self._behaviours is None:
            self._behaviours = self._place.section("behaviour", order=10)
        self.menus[name] = self._behaviours.buttons(name, choices, order=order)
        return self.menus[name]

    def show(self, snapshot: Snapshot) -> None:
        """Mark the present choices; the target to drag starts at the gaze target."""
        self._target_m = snapshot.p_world_target_m
        in_force = {
            BEHAVIOUR: snapshot.behaviour,
            CONVERSATION: snapshot.conversation,
            CHARACTER: snapshot.character or self._character,
        }
        for name, word in in_force.items():
            if name in self.menus:
                self.menus[name].current = word
