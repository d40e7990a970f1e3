// Frame of the page: headline, drawers, buttons under the head, swap of image and head.
//
// STOP is in stop.js, which also provides the state of the rig ("rig-state") and sends requests
// (window.rig). widgets.js fills the drawers.

const $ = (selector) => document.querySelector(selector);
const { ask, tell } = window.rig;

const moves = [...document.querySelectorAll("#moves button")];

// --- messages -------------------------------------------------------------------------

const SAID_MS = 6000;
let saidTimer = 0;

/** Show a message under the buttons for some seconds. @param {string} text */
function say(text) {
  clearTimeout(saidTimer);
  $("#said").textContent = text;
  saidTimer = setTimeout(() => { $("#said").textContent = ""; }, SAID_MS);
}

/** Set a text only if it has changed, so that a screen reader reads it once. */
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const LASTING = /, for \d.*$/; // duration of the control
let state = {};

const STALE_MS = 2500; // the door sends a heartbeat every second
const AGE_MS = 500;
let freshAt = performance.now();

/** Show the view in grey, with its age, when nothing new has come. */
function age() {
  const old = performance.now() - freshAt, stale = old > STALE_MS;
  const note = $("#stage .age");
  $("#stage").classList.toggle("stale", stale);
  note.hidden = !stale;
  if (stale) write(note, `as it was ${Math.round(old / 1000)} s ago`);
}
setInterval(age, AGE_MS);

function show(now) {
  state = now;
  if (!state.silent) freshAt = performance.now();
  age();
  const controlled = state.control_kind && state.control_kind !== "gaze";
  const headline = state.silent ? "nothing comes from the rig"
    : state.headline || state.control_sentence || "awake";
  write($("#headline"), headline);
  // A change of control is read out; the target changes three times a second.
  const control = (state.control_sentence ?? "").replace(LASTING, "");
  write($("#control"), headline.startsWith(control) ? "" : state.control_sentence);
  write($("#announced"), controlled ? control : "");
  document.body.dataset.control = state.control_kind ?? "";
  write($("#busy"), state.busy || "");
  $("#busy").hidden = !state.busy;
  document.title = `${state.stopped ? "■ stopped - " : state.silent ? "! silent - " : ""}gazerig`;
  followUnasked();
  $("#opponent").hidden = !state.opponent;
  for (const button of moves) {
    const why = state.refused?.[button.textContent.trim()];
    if (why) button.setAttribute("aria-disabled", "true");
    else button.removeAttribute("aria-disabled");
    if (button.title !== (why ?? "")) button.title = why ?? "";
  }
}

window.addEventListener("rig-state", (event) => show(event.detail));

// --- buttons --------------------------------------------------------------------------

for (const button of moves) {
  const { track, menu, choice } = button.dataset;
  const what = track ? { do: "play", track } : { do: "ask", menu, choice };
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

// --- the head looks at the pointer -----------------------------------------------------

const POINT_MS = 50, AGAIN_MS = 250;
const RESTED_MS = 3000; // the rig ends the control a second after the last point
const FREE = new Set(["", "gaze", "track", "pointer"]); // that the pointer may replace
const following = () => $("#pointer").getAttribute("aria-pressed") === "true";
// The pointer moves the opponent of a boxing world instead of the gaze.
const boxing = () => !$("#opponent").hidden && $("#opponent").getAttribute("aria-pressed") === "true";
let pointer = null; // over the view: {x, y, aspect}
let moved = false, movedAt = 0, sentAt = 0;
let takesOver = false; // the button was pressed: replace any control
let held = false; // a finger is on the view

function pointed(event) {
  // Dragging turns the view; a finger, which cannot point otherwise, is followed instead.
  if (event.pointerType === "touch") {
    if (!following() && !boxing()) return;
    if (!event.isPrimary) return;
    held = true;
    event.stopImmediatePropagation();
  } else if (event.buttons) return;
  const { innerWidth, innerHeight } = event.view;
  const x = event.clientX / innerWidth, y = event.clientY / innerHeight;
  if (!(x >= 0 && x <= 1 && y >= 0 && y <= 1)) return;
  pointer = { x, y, aspect: innerWidth / innerHeight };
  moved = true;
  movedAt = performance.now();
}

const pointerGone = () => { pointer = null; held = false; };

setInterval(() => {
  const now = performance.now();
  if (state.control_kind === "pointer") takesOver = false;
  if (!pointer || !(following() || boxing()) || document.hidden) return;
  if (!held && now - movedAt > RESTED_MS) return;
  const free = takesOver || FREE.has(state.control_kind ?? "");
  if (state.stopped || !(boxing() || free)) return;
  if (!moved && now - sentAt < AGAIN_MS) return;
  moved = false;
  sentAt = now;
  tell({ point: boxing() ? { ...pointer, opponent: true } : pointer });
}, POINT_MS);

// On from the start if no real head would turn away from the people in front of it.
let begun = false;
function followUnasked() {
  if (begun || state.emulated === undefined) return;
  begun = true;
  $("#pointer").setAttribute("aria-pressed", String(state.emulated));
}

$("#pointer").addEventListener("click", () => { takesOver = toggled($("#pointer")); });

$("#opponent").addEventListener("click", () => {
  if (toggled($("#opponent"))) say("Look at both or over its shoulder, and point at the opponent.");
});

function watchPointer() {
  const inside = $("#view").contentWindow;
  for (const kind of ["pointermove", "pointerdown"]) inside.addEventListener(kind, pointed, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    inside.addEventListener(kind, (event) => {
      if (event.pointerType === "touch" && event.isPrimary) pointerGone();
    }, true);
  }
  // Else the browser scrolls by the finger, and sends no more of its places.
  inside.addEventListener("touchmove", (event) => {
    if ((following() || boxing()) && event.touches.length === 1) event.preventDefault();
  }, { passive: false });
  inside.document.documentElement.addEventListener("pointerleave", pointerGone);
}
$("#view").addEventListener("load", watchPointer);
if ($("#view").contentDocument?.readyState === "complete") watchPointer();

// --- picture and head -----------------------------------------------------------------

$("#camera").addEventListener("load", ({ target }) => { // that of an image does not bubble
  if (target.naturalHeight) {
    $("#camera").style.setProperty("--aspect", target.naturalWidth / target.naturalHeight);
  }
}, true);

// --- drawers --------------------------------------------------------------------------

const tabs = [...document.querySelectorAll("[role=tab]")];
const panelOf = (tab) => document.getElementById(tab.getAttribute("aria-controls"));
const left = new Map(); // element with the focus in a closed drawer
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

// --- content of the drawers ----------------------------------------------------------

import("/rig/widgets.js").then(({ mount }) => mount(document)).catch(() => { /* no panels yet */ });
