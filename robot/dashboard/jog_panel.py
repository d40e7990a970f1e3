"""Sliders that put joints at angles, each with the joint's limits and its measured angle."""

from collections.abc import Mapping, Sequence
from html import escape
from math import degrees, radians

import viser

from gazerig.robot.dashboard.outbox import Outbox
from gazerig.robot.dashboard.widget import put
from gazerig.robot.model.commands import Jog, LookAt
from gazerig.robot.model.types import Snapshot, in_order

_STEP_DEG = 0.1
_FIRST, _LAST = 1, 100
"""Places of the sliders in the tab, and of what stands below them."""
_FOLLOWS_DEG = 0.15
"""A slider that is not held follows its joint in steps of this."""
_FREE_AFTER_S = 0.5
"""A jogged joint whose desired angle is another for this long is no longer jogged."""
_SAME_DEG = 0.3
MEASURED, ESTIMATED = "measured", "estimated (not measured)"
_RIGHT = "text-align:right"
_TABLE_EVERY = 5  # with every fifth frame, some 5 times a second: figures are to be read


class JogPanel:
    """One slider a joint."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, outbox: Outbox) -> None:
        """Fill the tab; the sliders come with the joints' limits."""
        self._gui = gui
        self._tab = tab
        self._outbox = outbox
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        # Joint -> angle asked for and the time of the last frame in which it was requested.
        self._held: dict[str, tuple[float, float]] = {}
        self._now_s = 0.0
        self._table, self._shown = "", 0
        with tab:
            gui.add_html(
                "<div style='padding:4px 12px;font-size:12.5px;opacity:.85'>Moving one holds all "
                "others where they are, slowly and inside the guard's limits.</div>",
                order=0,
            )
            free = gui.add_button("let go: look freely", order=_LAST, icon=viser.Icon.EYE)
            self._measured = gui.add_html("", order=_LAST + 1)

        @free.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._held.clear()
            self._outbox.command(LookAt(None), str(event.client_id))

    def values(self, in_force: Mapping[str, object]) -> None:
        """Create the sliders, and keep their ends at the joints' limits."""
        keys = [key.split(".") for key in in_force if key.startswith("joints.")]
        for joint in in_order(path[1] for path in keys if path[2:] == ["min_deg"]):
            low, high = (in_force.get(f"joints.{joint}.{end}_deg") for end in ("min", "max"))
            if not (isinstance(low, int | float) and isinstance(high, int | float)):
                continue
            slider = self._sliders.get(joint)
            if slider is None:
                self._sliders[joint] = self._add(joint, float(low), float(high))
            elif (slider.min, slider.max) != (low, high):
                slider.min, slider.max = float(low), float(high)

    def _add(self, joint: str, low_deg: float, high_deg: float) -> viser.GuiSliderHandle[float]:
        with self._tab:
            slider = self._gui.add_slider(
                joint.replace("_", " "),
                min=low_deg,
                max=high_deg,
                step=_STEP_DEG,
                initial_value=0.0,
                hint=f"{low_deg:g} to {high_deg:g} deg; + left, up, open, right ear down",
                order=_FIRST + len(self._sliders),
            )

        @slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is not None:  # else it followed its joint
                self._jog(joint, float(event.target.value), str(event.client_id))

        return slider

    def _jog(self, joint: str, angle_deg: float, who: str) -> None:
        self._held[joint] = (angle_deg, self._now_s)
        self._outbox.command(Jog(((joint, radians(angle_deg)),)), who)

    def show(self, snapshot: Snapshot) -> None:
        """Write the measured angles; sliders that are not held follow them."""
        if snapshot.t_s < self._now_s:  # the rig's clock was started again
            self._held.clear()
        self._now_s = snapshot.t_s
        places = {joint: i for i, joint in enumerate(snapshot.joints)}
        for joint, slider in self._sliders.items():
            if (i := places.get(joint)) is None:
                continue
            self._note_held(joint, degrees(snapshot.desired_rad[i]), bool(snapshot.stopped))
            angle_deg = degrees(snapshot.measured_rad[i])
            if joint not in self._held and abs(slider.value - angle_deg) > _FOLLOWS_DEG:
                put(slider, round(min(max(angle_deg, slider.min), slider.max), 1))
        self._shown += 1
        if self._shown % _TABLE_EVERY == 1:
            table = measured_table(snapshot)
            if table != self._table:
                self._measured.content = self._table = table

    def _note_held(self, joint: str, desired_deg: float, stopped: bool) -> None:
        """Forget a joint that was let go elsewhere, by a stop or another command."""
        held = self._held.get(joint)
        if held is None:
            return
        angle_deg, at_s = held
        if stopped:
            del self._held[joint]
        elif abs(desired_deg - angle_deg) < _SAME_DEG:
            self._held[joint] = (angle_deg, self._now_s)
        elif self._now_s - at_s > _FREE_AFTER_S:
            del self._held[joint]


def measured_table(snapshot: Snapshot) -> str:
    """List every joint's desired and measured angle in degrees, as HTML.

    What is not measured is in a column of its own: an estimated angle looks like any other.
    """
    estimated = frozenset(snapshot.estimated)
    columns = ["desired"]
    if not estimated.issuperset(snapshot.joints):
        columns.append(MEASURED)
    if estimated:
        columns.append(ESTIMATED)
    joints = zip(snapshot.joints, snapshot.desired_rad, snapshot.measured_rad, strict=True)
    rows = "".join(
        _row(
            escape(joint.replace("_", " ")),
            [degrees(desired), *_under(columns[1:], joint in estimated, degrees(now))],
        )
        for joint, desired, now in joints
    )
    head = "".join(f"<td style='{_RIGHT}'>{text}</td>" for text in columns)
    return (
        "<table style='margin:4px 12px;font-size:12px;width:calc(100% - 24px);"
        "font-variant-numeric:tabular-nums'><tr style='opacity:.6'><td>degrees</td>"
        f"{head}</tr>{rows}</table>"
    )


def _under(columns: Sequence[str], estimated: bool, angle_deg: float) -> list[float | None]:
    """Show an angle below the joint's present one."""
    kind = ESTIMATED if estimated else MEASURED
    return [angle_deg if column == kind else None for column in columns]


def _row(name: str, angles_deg: Sequence[float | None]) -> str:
    cells = "".join(
        f"<td style='{_RIGHT}'>{'' if angle is None else f'{angle:.1f}'}</td>"
        for angle in angles_deg
    )
    return f"<tr><td>{name}</td>{cells}</tr>"
