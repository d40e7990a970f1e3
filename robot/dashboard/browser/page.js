// Frame of the page: headline, drawers with their panels, buttons under the head.
//
// STOP is in stop.js, which needs none of this. A panel is one file like health.js: an object with
// the drawer, a title (of its section, if it has one), the shortest time between two drawings, and
// build(place), which adds its elements and may return a function that draws the newest data.

import { choices, onChoices } from "/rig/choices.js";
import { onShown } from "/rig/camera.js";
import { now, on } from "/rig/connection.js";
import { make, note, section, write } from "/rig/elements.js";
import health, { alarm } from "/rig/health.js";
import { order, say } from "/rig/orders.js";
import play from "/rig/play.js";
import scene from "/rig/scene.js";
import "/rig/stage.js";
import steer from "/rig/steer.js";
import talk from "/rig/talk.js";
import tune from "/rig/tune.js";
import watch from "/rig/watch.js";
import { isLed, reason } from "/rig/words.js";

const PANELS = [watch, scene, steer, play, talk, tune, health];

const $ = (selector) => document.querySelector(selector);

// --- headline -----------------------------------------------------------------------------------

function title(state) {
  const mark = state?.stopped ? "■ stopped - " : now.silent ? "! silent - " : "";
  document.title = `${mark}gazerig`;
}

onShown((shown) => {
  const led = isLed(shown), person = shown.addressed_by;
  write($("#headline"), shown.headline);
  const why = person ? `person ${person} addresses it`
    : led || shown.level === "torque_off" ? "" : reason(shown, now.run, 1);
  write($("#control"), why);
  // A change of control is read out; the target changes three times a second.
  const lasting = / for \d.*$/;
  write($("#announced"), led ? shown.headline.replace(lasting, "") : "");
  document.body.dataset.control = shown.control_source.kind;
  title(now.state);
});

on("silent", () => {
  write($("#headline"), "nothing comes from the rig");
  write($("#control"), "");
  title(now.state);
});

on("run", ({ busy }) => {
  write($("#busy"), busy ?? "");
  $("#busy").hidden = !busy;
});

let alarmed = "";

on("state", (state) => { // banners for held joints and an old frame
  const found = alarm(state), text = JSON.stringify(found);
  if (text === alarmed) return;
  alarmed = text;
  const [name, kind, reasons] = found ?? ["", "", []];
  const banner = make("div", { className: `banner ${kind}` }, make("b", { textContent: name }),
    ...reasons.map((line) => make("div", { textContent: line })));
  $("#alarm").replaceChildren(...(found ? [banner] : []));
});

// --- buttons under the head ---------------------------------------------------------------------

const moves = [...document.querySelectorAll("#moves button")];
const WITH_LIDS = ["wink", "surprised", "sleepy"];

/** Why the rig cannot do what a button means, "" if it can. */
function refusal(name) {
  const { menus } = choices;
  if (!now.rig || !Object.keys(menus).length) return "";
  if (!menus.track) return "not while a calibration is under way";
  const lids = Object.keys(now.rig.joints).some((joint) => joint.includes("lid"));
  if (!lids && WITH_LIDS.includes(name)) return "this rig has no lids";
  const known = name === "wink" || menus.track.includes(name);
  return known ? "" : "this rig has none of the joints that it moves";
}

onChoices(() => {
  for (const button of moves) {
    const why = refusal(button.textContent.trim());
    if (why) button.setAttribute("aria-disabled", "true");
    else button.removeAttribute("aria-disabled");
    button.title = why;
  }
});

for (const button of moves) {
  const { track, menu, choice } = button.dataset;
  button.addEventListener("click", () => {
    if (button.getAttribute("aria-disabled") === "true") return say(button.title);
    order(track ? { do: "play", track } : { do: "ask", menu, choice });
  });
}

// --- panels -------------------------------------------------------------------------------------

const TICK_MS = 50;
const drawers = new Map(); // name -> panels: {panel, fold, draw, dueAt}

for (const panel of PANELS) {
  const place = $(`#drawer-${panel.drawer}`);
  const fold = panel.title ? section(panel.title, Boolean(panel.open)) : null;
  if (fold) place.append(fold.node);
  const one = { panel, fold: fold?.node, dueAt: 0 };
  try {
    one.draw = panel.build(fold?.body ?? place);
  } catch (error) {
    place.append(note(`the panel has failed: ${error.message}`));
  }
  if (!drawers.has(panel.drawer)) drawers.set(panel.drawer, []);
  drawers.get(panel.drawer).push(one);
}

/** Draw the panels of the open drawer that are due. */
function drawPanels() {
  if (!open || !now.state || !now.shown || document.hidden) return;
  const time = performance.now();
  for (const one of drawers.get(nameOf(open)) ?? []) {
    if (!one.draw || time < one.dueAt || one.fold?.open === false) continue;
    one.dueAt = time + one.panel.every_ms;
    try {
      one.draw(now);
    } catch (error) { // the others go on
      console.error(error);
    }
  }
}
setInterval(drawPanels, TICK_MS);

// --- drawers ------------------------------------------------------------------------------------

const tabs = [...document.querySelectorAll("[role=tab]")];
const nameOf = (tab) => tab.id.replace("tab-", "");
const drawerOf = (tab) => $(`#drawer-${nameOf(tab)}`);
let open = null;

/** Open a tab's drawer and close the other; null closes all. */
function choose(tab) {
  open = tab;
  for (const each of tabs) {
    each.setAttribute("aria-selected", String(each === tab));
    if (tab) each.tabIndex = each === tab ? 0 : -1;
    drawerOf(each).hidden = each !== tab;
  }
  $("#drawer").hidden = !tab;
  document.body.classList.toggle("open", Boolean(tab));
  for (const one of tab ? drawers.get(nameOf(tab)) ?? [] : []) one.dueAt = 0;
  drawPanels(); // what is already known must not move it later
}

function closeDrawer() {
  const tab = open;
  choose(null);
  tab?.focus();
}

for (const tab of tabs) {
  tab.addEventListener("click", () => (tab === open ? closeDrawer() : choose(tab)));
  tab.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const next = tabs[(tabs.indexOf(tab) + step + tabs.length) % tabs.length];
    for (const each of tabs) each.tabIndex = each === next ? 0 : -1;
    next.focus();
  });
}

window.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && open && !event.defaultPrevented) closeDrawer();
  // The space bar stops the rig, so that Enter ticks a box as well.
  if (event.key === "Enter" && event.target.matches?.("input[type=checkbox]")) event.target.click();
});
