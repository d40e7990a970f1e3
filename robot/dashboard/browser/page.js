// The page's frame: headline, drawers, buttons under the head, picture and head changing places.
//
// STOP is in stop.js, which also brings the state of the rig ("rig-state") and takes what is asked
// (window.rig). What the drawers hold is filled in by widgets.js.

const $ = (selector) => document.querySelector(selector);
const { ask } = window.rig;

// --- what is said ---------------------------------------------------------------------

const SAID_MS = 6000;
let saidTimer = 0;

/** Say something under the buttons for a while. @param {string} text */
function say(text) {
  clearTimeout(saidTimer);
  $("#said").textContent = text;
  saidTimer = setTimeout(() => { $("#said").textContent = ""; }, SAID_MS);
}

/** Write a text where it has changed, so that a screen reader reads it once. */
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function show(state) {
  const headline = state.recording ? "a recording" : state.silent ? "the rig is silent"
    : state.headline || (state.stopped ? `stopped: ${state.stopped}` : "awake");
  write($("#headline"), [state.leads_words, headline].filter(Boolean).join(" · "));
  write($("#busy"), state.busy || "");
  $("#busy").hidden = !state.busy;
  document.title = state.stopped ? "■ stopped - gazerig" : "gazerig";
}

window.addEventListener("rig-state", (event) => show(event.detail));

// --- buttons --------------------------------------------------------------------------

for (const button of document.querySelectorAll("#moves button")) {
  const { gesture, menu, choice } = button.dataset;
  const what = gesture ? { do: "play", gesture } : { do: "ask", menu, choice };
  button.addEventListener("click", () => {
    if (button.getAttribute("aria-disabled") === "true") return say(button.title);
    ask(what).catch((error) => say(`not done: ${error.message}`));
  });
}

function toggled(button) {
  const on = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(on));
  return on;
}

$("#swap").addEventListener("click", () => {
  document.body.classList.toggle("swapped", toggled($("#swap")));
});

// --- drawers --------------------------------------------------------------------------

const tabs = [...document.querySelectorAll("[role=tab]")];
const panelOf = (tab) => document.getElementById(tab.getAttribute("aria-controls"));
const left = new Map(); // what had the focus in a drawer that was closed
let open = null;

/** Open a tab's drawer and close the other; null closes all. */
function choose(tab) {
  if (open) {
    const inside = panelOf(open).contains(document.activeElement);
    if (inside) left.set(open, document.activeElement);
  }
  open = tab;
  for (const each of tabs) {
    each.setAttribute("aria-selected", String(each === tab));
    if (tab) each.tabIndex = each === tab ? 0 : -1;
    panelOf(each).hidden = each !== tab;
  }
  $("#drawer").hidden = !tab;
  document.body.classList.toggle("open", Boolean(tab));
  window.dispatchEvent(new CustomEvent("rig-drawer", { detail: tab?.id.replace("tab-", "") ?? "" }));
}

function closeDrawer() {
  const tab = open;
  choose(null);
  tab?.focus();
}

for (const tab of tabs) {
  tab.addEventListener("click", () => {
    if (tab === open) return closeDrawer();
    choose(tab);
    const before = left.get(tab);
    if (before?.isConnected) before.focus();
  });
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

// --- what is in the drawers -----------------------------------------------------------

import("/rig/widgets.js").then(({ mount }) => mount(document)).catch(() => { /* none yet */ });
