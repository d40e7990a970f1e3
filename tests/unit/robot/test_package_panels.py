"""Panels of packages return HTML; a failed one shows why, and the page continues."""

from outside_package import install, on_path
from page_feed import shown

from gazerig.robot.dashboard.package_panels import PackagePanels
from gazerig.robot.loop.head_state import head_state

CODE = """
def phase(state): return f"<p>{state.gaze.phase}</p>"
def broken(state): raise RuntimeError("no <bulb>")
"""
NAMES = {"phase": "counter:phase", "broken": "counter:broken", "none": "counter:nothing"}


def test_panels_of_packages_are_drawn_and_failures_named(tmp_path):
    install(tmp_path, "counter", {"gazerig.page_panel": NAMES}, {"counter": CODE})
    state = head_state(shown().tick)
    with on_path(tmp_path):
        panels = PackagePanels()
        first = {panel.title: panel.html for panel in panels.draw(state)}
        assert first["phase"] == f"<p>{state.gaze.phase}</p>"
        assert "RuntimeError: no &lt;bulb&gt;" in first["broken"] and "nothing" in first["none"]
        assert [panel.title for panel in panels.draw(state)] == ["phase"]
