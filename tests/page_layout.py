"""Unreadable, unreachable or invisible elements of the page, measured in a browser."""

import json
from functools import cache
from importlib.resources import files
from typing import Any

from browser import Browser

LEAST_TEXT_PX = 13.0
# Of each control some points are asked for what lies on top there. What a drawer holds may be
# scrolled away up and down, never to the side.
MEASURE = """(() => {
  const faults = [];
  const name = e => `${e.tagName.toLowerCase()}${e.id ? '#' + e.id : ''}` +
    ` "${(e.textContent || e.getAttribute('aria-label') || '').trim().slice(0, 30)}"`;
  const seen = e => e.checkVisibility({visibilityProperty: true, opacityProperty: true});
  const scrolls = e => e.closest('#drawer, #camera, #notices');
  const inside = (r, o) => r.left >= o.left - 1 && r.right <= o.right + 1;
  const page = {left: 0, right: innerWidth, top: 0, bottom: innerHeight};
  const shown = [...document.querySelectorAll('button, input, select, textarea, summary, iframe,' +
    '[role=tab], [role=button]')].filter(seen);
  for (const e of shown) {
    const r = e.getBoundingClientRect();
    if (r.width < 1 || r.height < 1) continue;  // is drawn by its label
    const hold = scrolls(e), o = hold ? hold.getBoundingClientRect() : page;
    if (!inside(r, o)) faults.push(`${name(e)} is cut off at the side`);
    if (!hold && (r.top < -1 || r.bottom > innerHeight + 1)) {
      faults.push(`${name(e)} is outside of the window`);
    }
    if (e.tagName === 'IFRAME') continue;
    for (const [x, y] of [[.5, .5], [.1, .2], [.9, .8]]) {
      const at = [r.left + x * r.width, r.top + y * r.height];
      if (at[1] < Math.max(o.top, 0) || at[1] > Math.min(o.bottom, innerHeight)) continue;
      const top = document.elementFromPoint(...at);
      if (!top || !(e.contains(top) || top.contains(e) || top.closest('label')?.contains(e)
          || top.closest('label')?.control === e)) {
        faults.push(`${name(e)} is covered by ${top ? name(top) : 'nothing'}`);
        break;
      }
    }
  }
  if (document.documentElement.scrollWidth > innerWidth) faults.push('the page is too wide');
  if (document.documentElement.scrollHeight > innerHeight) faults.push('the page is too high');
  for (const e of document.querySelectorAll('#drawer, #drawer > section, #notices, header')) {
    if (seen(e) && e.scrollWidth > e.clientWidth + 1) faults.push(`${name(e)} is too wide`);
  }
  const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (words.nextNode()) {
    const e = words.currentNode.parentElement;
    if (!words.currentNode.data.trim() || !seen(e) || e.closest('option, script, style')) continue;
    let px = parseFloat(getComputedStyle(e).fontSize);
    const svg = e.closest('svg');
    if (svg) px *= Math.abs(e.getScreenCTM?.().a ?? 1);
    if (px < LEAST - 0.01) faults.push(`${name(e)} is written in ${px.toFixed(1)} px`);
  }
  return [...new Set(faults)];
})()""".replace("LEAST", str(LEAST_TEXT_PX))

BOXES = """(() => Object.fromEntries(['stage', 'camera', 'drawer', 'rig-stop', 'moves', 'extras',
  'tabs', 'notices'].map(id => {
    const e = document.getElementById(id);
    if (!e.checkVisibility()) return [id, null];
    const boxes = [e, ...e.querySelectorAll('*')].map(x => x.getBoundingClientRect())
      .filter(r => r.width && r.height);
    if (!boxes.length) return [id, null];
    const r = id === 'moves' || id === 'tabs' || id === 'extras'
      ? {left: Math.min(...boxes.map(b => b.left)), top: Math.min(...boxes.map(b => b.top)),
         right: Math.max(...boxes.map(b => b.right)), bottom: Math.max(...boxes.map(b => b.bottom))}
      : e.getBoundingClientRect();
    return [id, [r.left, r.top, r.right, r.bottom]];
  })))()"""


def value(browser: Browser, script: str) -> Any:
    """Result of a script, once its promise is fulfilled."""
    answer = browser.ask(
        "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
    )
    assert "exceptionDetails" not in answer, answer["exceptionDetails"]
    return answer["result"].get("value")


def faults(browser: Browser) -> list[str]:
    """Elements that are cut off, covered, outside the window or too small."""
    found: list[str] = value(browser, MEASURE)
    return found


def boxes(browser: Browser) -> dict[str, tuple[float, float, float, float] | None]:
    """Left, top, right and bottom of the page's parts, None for a hidden one."""
    found: dict[str, Any] = value(browser, BOXES)
    return found


@cache
def _axe() -> str:
    return files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")


def violations(browser: Browser) -> list[str]:
    """Serious and critical faults of accessibility that axe-core finds, by rule and element."""
    if value(browser, "typeof axe") == "undefined":
        browser.run(_axe())
    # An attribute of ARIA 1.3, which browsers know and this axe does not yet.
    known = "checks: {'aria-valid-attr': {options: ['aria-description']}}"
    run = f"axe.run(document, {{iframes: false, resultTypes: ['violations'], {known}}})"
    kept = json.dumps(["serious", "critical"])
    found: list[str] = value(
        browser,
        f"{run}.then(r => r.violations.filter(v => {kept}.includes(v.impact)).flatMap(v => "
        "v.nodes.map(n => `${v.id}: ${n.target} ${n.failureSummary}`)))",
    )
    return found
