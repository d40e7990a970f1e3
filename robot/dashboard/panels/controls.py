"""Controls of the rig: the drawers Steer (gaze, behaviours, face, joints), Play and Tune."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import degrees, radians

import viser

from gazerig.gaze.track.expression import NEUTRAL
from gazerig.robot.dashboard.panels.param_panel import ParamPanel
from gazerig.robot.dashboard.panels.play_panel import PlayPanel
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widget import Buttons, Slider
from gazerig.robot.dashboard.widgets.widgets import Container, Widgets
from gazerig.robot.model.commands import Ask, Express, Jog, LookAt
from gazerig.robot.model.conversation import ConversationState
from gazerig.robot.model.types import Snapshot, order_joints

BEHAVIOUR, CONVERSATION, CHARACTER = "behaviour", "conversation", "character"

_TARGET_SCALE = 0.12
_DRAG, _FREE, _AHEAD = "drag a target", "look freely", "look straight ahead"


class Controls:
    """Drawers Steer (gaze, behaviours, face, joints), Play (tracks) and Tune (parameters)."""

    def __init__(self, widgets: Widgets, scene: viser.SceneApi, outbox: Outbox) -> None:
        self._widgets = widgets
        self._steer, self._tune = widgets.panel("steer"), widgets.panel("tune")
        self._jog = JogPanel(self._steer.section("joints", order=40), outbox)
        self._lead = GazeTargetPanel(self._steer, scene, outbox, self._jog.forget_jogged)
        self._tuning = ParamPanel(widgets, self._tune, outbox)
        self._face = ExpressionPanel(self._steer, outbox)
        self._play = PlayPanel(widgets.panel("play"), outbox)
        self._talk = TalkPanel(self._steer)
        self._first = FirstMenus(self._tune, outbox, self._lead.let_go)

    def offer(self, menus: Mapping[str, Sequence[str]]) -> None:
        """Add menus with their choices."""
        for name, choices in menus.items():
            if name == EXPRESSION:
                self._face.offer(choices)
            elif name == TRACK:
                self._play.offer(choices)
            else:
                self._lead.offer(name, choices)
                self._first.offer(name, choices)

    def add_tracks(self, infos: Sequence[object]) -> None:
        """Add what the rig reports of its tracks."""
        self._play.add_infos(infos)

    def add_params(self, params: Sequence[Mapping[str, object]]) -> None:
        """Add parameters that can be tuned, as the rig describes them."""
        self._tuning.add_params(params)

    def update_values(self, state: Mapping[str, object]) -> None:
        """Update the present values: changed and unsaved values, the file, characters."""
        self._tuning.update_values(state)
        self._jog.update_ranges(self._tuning.in_force)
        characters = state.get("characters")
        if isinstance(characters, list) and characters:
            self._lead.add_characters(characters, str(state.get("character", "")))
            self._first.offer(CHARACTER, characters)

    def show(self, snapshot: Snapshot) -> None:
        """Show measured values next to requested ones."""
        self._lead.show(snapshot)
        self._first.show(self._lead.menus)
        self._jog.show(snapshot)
        self._play.show(snapshot)
        self._talk.show(snapshot)

    def show_values(self) -> None:
        """Show all parameters in force again, after a refused change."""
        self._tuning.show_values()


class TalkPanel:
    """State of a conversation, as a voice agent reports it."""

    def __init__(self, place: Container) -> None:
        self.state = place.section("voice agent", is_open=False, order=15).html(order=1)

    def show(self, snapshot: Snapshot) -> None:
        """Show what the agent does."""
        self.state.content = note(talk_text(snapshot.talk, snapshot.t_s))


def talk_text(talk: ConversationState, t_s: float) -> str:
    """Return the state of a conversation in one line."""
    if talk.state == "idle":
        return f"no conversation; {talk.end_reason}" if talk.end_reason else "no conversation"
    words: list[str] = [talk.state]
    if talk.partner is not None:
        words.append(f"with person {talk.partner}")
    words.append(f"for {max(0.0, t_s - talk.since_s):.0f} s")
    if talk.ends_s is not None:
        words.append(f"{max(0.0, talk.ends_s - t_s):.0f} s to its planned end")
    return f"{talk.who or 'a client'}: {', '.join(words)}"


class GazeTargetPanel:
    """Controls of the gaze: menus, and a target that can be dragged through the scene."""

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

        def look_freely(_: str, client: str) -> None:
            self.drag.value = False
            self._show_target(on=False)
            self._let_go()
            self._outbox.command(LookAt(None), client)

        self.free.on_press(look_freely)
        self.let_go = look_freely

        # A coroutine: viser runs coroutines in order, but plain functions in any order.
        @self._gizmo.on_update
        async def look_at_gizmo(event: viser.TransformControlsEvent) -> None:
            x, y, z = map(float, event.target.position)
            if event.client_id is not None and event.phase != "start":
                self._outbox.command(LookAt((x, y, z)), str(event.client_id))

    def _show_target(self, on: bool) -> None:
        self._gizmo.visible = on
        if on:
            self._gizmo.position = self._target_m

    def offer(self, name: str, choices: Sequence[str]) -> None:
        """Add a menu as a row of buttons, or replace its choices."""
        if (before := self.menus.get(name)) is not None:
            before.options = choices
            return
        menu = self._add(name, choices, order=len(self.menus))

        def ask(choice: str, client: str) -> None:
            self._outbox.command(Ask(name, choice), client)

        menu.on_press(ask)

    def add_characters(self, names: Sequence[str], present: str) -> None:
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
        """Mark the present choices; the draggable target starts at the gaze target."""
        self._target_m = snapshot.p_world_target_m
        in_force = {
            BEHAVIOUR: snapshot.behaviour,
            CONVERSATION: snapshot.conversation,
            CHARACTER: snapshot.character or self._character,
        }
        for name, word in in_force.items():
            if name in self.menus:
                self.menus[name].current = word


class FirstMenus:
    """Menus with which Tune opens, next to the first parameters."""

    TITLES: Mapping[str, str] = {
        CONVERSATION: CONVERSATION, BEHAVIOUR: "activity", CHARACTER: CHARACTER,
    }  # fmt: skip
    """Menu -> its plain name."""
    AHEAD_M = (1.0, 0.0, 0.15)

    def __init__(
        self, place: Container, outbox: Outbox, let_go: Callable[[str, str], None]
    ) -> None:
        self._place, self._outbox = place, outbox
        self.menus: dict[str, Buttons] = {}
        self.target = place.buttons("target", (_FREE, _AHEAD), order=0.5)

        def look(choice: str, client: str) -> None:
            if choice == _FREE:
                let_go(choice, client)
            else:
                outbox.command(LookAt(self.AHEAD_M, stay=True), client)

        self.target.on_press(look)

    def offer(self, name: str, choices: Sequence[str]) -> None:
        """Add a menu, or replace its choices; others than the first are ignored."""
        if (before := self.menus.get(name)) is not None:
            before.options = tuple(sorted(choices))
        elif (title := self.TITLES.get(name)) is not None:
            order = 2.0 + 0.1 * list(self.TITLES).index(name)
            menu = self.menus[name] = self._place.buttons(
                title, tuple(sorted(choices)), order=order
            )

            def ask(choice: str, client: str) -> None:
                if name == CHARACTER:
                    self._outbox.ask({"do": "character", "name": choice}, client)
                else:
                    self._outbox.command(Ask(name, choice), client)

            menu.on_press(ask)

    def show(self, shown: Mapping[str, Buttons]) -> None:
        """Mark the present choices, like the other menus."""
        for name, menu in self.menus.items():
            if name in shown:
                menu.current = shown[name].current


EXPRESSION = "expression"
TRACK = "track"
"""Names of the menus that are shown here."""


class ExpressionPanel:
    """Section of the controls; it appears when the rig offers expressions."""

    def __init__(self, place: Container, outbox: Outbox) -> None:
        self._place, self._outbox = place, outbox
        self.expressions: Buttons | None = None
        self.strength: Slider | None = None

    def offer(self, names: Sequence[str]) -> None:
        """Show a button for each expression, instead of the previous ones."""
        options = tuple(sorted(names, key=lambda name: (name != NEUTRAL, name)))
        if self.expressions is not None:
            self.expressions.options = options
            return
        section = self._place.section("face", order=20)
        self.expressions = section.buttons(EXPRESSION, options, order=1)
        strength = self.strength = section.slider("strength", (0.0, 1.0), 0.05, 1.0, order=2)

        def express(name: str, client: str) -> None:
            self._outbox.command(Express(name, float(strength.value)), client)

        self.expressions.on_press(express)


TRACKS = ("nod", "shake", "surprised", "sleepy")
WINK = "wink"
_WITH_LIDS = ("surprised", "sleepy")
_NO_LIDS = "this rig has no lids"
_NOT_NOW = "not while a calibration is under way"
_NO_JOINTS = "this rig has none of the joints that it moves"


def refused_moves(
    menus: Mapping[str, Sequence[str]], joints: Sequence[str] | None
) -> dict[str, str]:
    """Return button -> reason for the buttons whose action this rig cannot do.

    Args:
        menus: Menus of the rig; empty before they are received.
        joints: Names of the rig's joints; None before they are known.
    """
    if not menus:
        return {}
    if "track" not in menus:
        return dict.fromkeys((*TRACKS, WINK), _NOT_NOW)
    no_lids = joints is not None and not any("lid" in joint for joint in joints)
    refused = {
        name: _NO_LIDS if no_lids and name in _WITH_LIDS else _NO_JOINTS
        for name in TRACKS
        if name not in menus["track"]
    }
    return {**refused, WINK: _NO_LIDS} if no_lids else refused


_STEP_DEG = 0.1
_FIRST, _LAST = 1, 100
"""Order of the sliders and of the elements below them."""
_FOLLOWS_DEG = 0.15
"""Step in which a slider follows its joint, deg."""
_FREE_AFTER_S = 0.5
"""Time with another desired angle after which a joint no longer counts as jogged, s."""
_SAME_DEG = 0.3
ESTIMATED = "estimated from the goals, not measured: the servos give no feedback"


class JogPanel:
    """One slider for each joint; they are created when the limits are known."""

    def __init__(self, place: Container, outbox: Outbox) -> None:
        self._place, self._outbox = place, outbox
        self.sliders: dict[str, Slider] = {}
        # Joint -> requested angle and the time of the last frame in which it was desired.
        self._held: dict[str, tuple[float, float]] = {}
        self._now_s = 0.0
        place.html(
            note(
                "This moves the joint of the real head slowly, within the guard's limits. All "
                'others hold their angles until you press "look freely".'
            ),
            order=0,
        )
        self.estimated_joints_note = place.html(order=_LAST)

    def forget_jogged(self) -> None:
        """Forget the jogged joints; their sliders follow them again."""
        self._held.clear()

    def update_ranges(self, in_force: Mapping[str, object]) -> None:
        """Create the sliders, and set their ranges to the joints' limits."""
        keys = [key.split(".") for key in in_force if key.startswith("joints.")]
        for joint in order_joints(path[1] for path in keys if path[2:] == ["min_deg"]):
            low, high = (in_force.get(f"joints.{joint}.{end}_deg") for end in ("min", "max"))
            if not (isinstance(low, int | float) and isinstance(high, int | float)):
                continue
            slider = self.sliders.get(joint)
            if slider is not None:
                slider.ends = (float(low), float(high))
                continue
            slider = self.sliders[joint] = self._place.slider(
                joint.replace("_", " "),
                (float(low), float(high)),
                _STEP_DEG,
                min(max(0.0, float(low)), float(high)),
                hint=(
                    f"moves the joint, slowly; {low:g} to {high:g} deg, + left, up, open, "
                    "right ear down"
                ),
                order=_FIRST + len(self.sliders),
            )
            slider.on_change(partial(self._jog, joint))

    def _jog(self, joint: str, angle_deg: float, who: str) -> None:
        self._held[joint] = (angle_deg, self._now_s)
        self._outbox.command(Jog(((joint, radians(angle_deg)),)), who)

    def show(self, snapshot: Snapshot) -> None:
        """Update the sliders of joints that are not jogged; list joints that are not measured."""
        if snapshot.t_s < self._now_s:  # the rig's clock was restarted
            self._held.clear()
        self._now_s = snapshot.t_s
        places = {joint: i for i, joint in enumerate(snapshot.joints)}
        for joint, slider in self.sliders.items():
            if (i := places.get(joint)) is None:
                continue
            if (held := self._held.get(joint)) is not None:
                asked_deg, at_s = held
                if not snapshot.stopped and (
                    abs(degrees(snapshot.desired_rad[i]) - asked_deg) < _SAME_DEG
                ):
                    self._held[joint] = (asked_deg, self._now_s)
                elif snapshot.stopped or self._now_s - at_s > _FREE_AFTER_S:
                    del self._held[joint]  # a stop or another command has released it
            angle_deg = degrees(snapshot.measured_rad[i])
            if joint not in self._held and abs(slider.value - angle_deg) > _FOLLOWS_DEG:
                low, high = slider.ends
                slider.value = round(min(max(angle_deg, low), high), 1)
        self.estimated_joints_note.content = estimated_joints_note(snapshot)


def estimated_joints_note(snapshot: Snapshot) -> str:
    """Return the joints with estimated angles as HTML, "" if all are measured."""
    estimated = [joint for joint in snapshot.joints if joint in frozenset(snapshot.estimated)]
    if not estimated:
        return ""
    names = "all joints" if len(estimated) == len(snapshot.joints) else ", ".join(estimated)
    return note(f"{names.replace('_', ' ')}: {ESTIMATED}")
