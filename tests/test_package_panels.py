"""Panels of one file, ours and those of packages; a failed one shows why, the page continues."""

from pathlib import Path

from outside_package import install, on_path
from test_page_parts import looking

from gazerig.robot.dashboard.panels.event_timeline import STRIP_S, Timeline
from gazerig.robot.dashboard.panels.package_panels import PagePanels, core_panels
from gazerig.robot.dashboard.widgets.widgets import Widgets

CODE = """
from gazerig.robot.dashboard.panels.package_panels import PagePanel
class Count(PagePanel):
    title = "snapshots"
    def __init__(self): self.n = 0
    def update(self, snapshot): self.n += 1
    def drawing(self): return f"<p>{self.n}</p>"
class Broken(Count):
    title = "broken"
    def update(self, snapshot): raise RuntimeError("no bulb")
class NoPanel: pass
"""
NAMES = {"count": "counter:Count", "broken": "counter:Broken", "none": "counter:NoPanel"}


def contents(widgets: Widgets) -> list[str]:
    return [widget.content for widget in widgets._widgets.values() if hasattr(widget, "content")]


def test_panels_of_packages_are_drawn_and_failures_named(tmp_path: Path) -> None:
    install(tmp_path, "counter", {"gazerig.page_panel": NAMES}, {"counter": CODE})
    with on_path(tmp_path):
        widgets = Widgets()
        panels = PagePanels(widgets.panel("watch"))
        panels.begin()
        for _ in range(3):
            panels.update(looking(0.0))
        panels.draw(0)
        shown = " ".join(contents(widgets))
        assert "<p>3</p>" in shown and "RuntimeError: no bulb" in shown
        assert "is no subclass of PagePanel" in shown
        panels.begin()
        panels.draw(0)
        assert "<p>0</p>" in " ".join(contents(widgets))


def test_panels_of_this_folder_are_found_and_drawn_when_they_are_due() -> None:
    assert list(core_panels()) == [Timeline]
    widgets = Widgets()
    panels = PagePanels(widgets.panel("watch"))
    panels.begin()
    panels.update(looking(0.0))
    panels.draw(Timeline.period - 1)
    assert not any(contents(widgets))
    panels.draw(Timeline.period)
    assert f"the last {STRIP_S:.0f} seconds: looked at" in "".join(contents(widgets))
