// The head's view: "loading" until the head is drawn, grey when nothing new comes, and the pointer
// over it, at which the head looks.

import { isLost, now, on, tell } from "/rig/connection.js";
import { showAge } from "/rig/elements.js";
import { say } from "/rig/orders.js";

const $ = (selector) => document.querySelector(selector);
const stage = $("#stage"), view = $("#view");

// --- loading and age ----------------------------------------------------------------------------

const HEAD_TRIANGLES = 1000; // the frame draws less while it has no head
const LOOK_MS = 200;
let freshAt = performance.now();

on("state", () => { freshAt = performance.now(); });

/** Number of triangles that the frame shows. */
function triangles() {
  let found = 0;
  view.contentWindow?.__viserMutable?.scene?.traverseVisible(({ geometry }) => {
    found += (geometry?.index?.count ?? geometry?.attributes.position?.count ?? 0) / 3;
  });
  return found;
}

/** Show "loading" until the head is drawn. */
function load() {
  stage.classList.add("loading");
  const timer = setInterval(() => {
    if (triangles() < HEAD_TRIANGLES) return;
    clearInterval(timer);
    // Once drawn: after the frame's next two pictures.
    const { contentWindow: inside } = view;
    inside.requestAnimationFrame(() => inside.requestAnimationFrame(
      () => stage.classList.remove("loading"),
    ));
  }, LOOK_MS);
}

showAge(stage, () => freshAt);

// --- the pointer --------------------------------------------------------------------------------

const POINT_MS = 50, AGAIN_MS = 250;
const RESTED_MS = 3000; // the rig ends the control a second after the last point
const FREE = ["gaze", "track", "pointer"]; // kinds of control that the pointer may replace
const TOWARDS_HEAD = 0.6; // distance of the pointer's plane, of that to the head
const NEAREST_M = 0.02;
const GUARD_M = [0.7, 0, 0]; // the opponent's fist at rest
const OPPONENT_BOX_M = [[0.36, 1.2], [-0.6, 0.6], [-0.4, 0.45]]; // as in robot/model/commands.py

const isOn = (id) => $(id).getAttribute("aria-pressed") === "true";
const following = () => isOn("#pointer");
const boxing = () => !$("#opponent").hidden && isOn("#opponent");
let pointer = null; // over the view: {x, y}, 0..1 from the left and from the top
let moved = false, movedAt = 0, sentAt = 0;
let takesOver = false; // the button was pressed: replace any control
let held = false; // a finger is on the view

/** Press or release a button; return whether it is pressed now. */
function toggle(button) {
  const pressed = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(pressed));
  return pressed;
}

function point(event) {
  // Dragging turns the view; a finger, which cannot point otherwise, is followed instead.
  if (event.pointerType === "touch") {
    if (!following() && !boxing()) return;
    if (!event.isPrimary) return;
    held = true;
    event.stopImmediatePropagation();
  } else if (event.buttons) return;
  const x = event.clientX / event.view.innerWidth, y = event.clientY / event.view.innerHeight;
  if (!(x >= 0 && x <= 1 && y >= 0 && y <= 1)) return;
  pointer = { x, y };
  moved = true;
  movedAt = performance.now();
}

const leave = () => { pointer = null; held = false; };
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const sub = (a, b) => a.map((value, i) => value - b[i]);

/** The viewer: place, and directions ahead and through the pointer, in the world of the rig. */
function viewer({ x, y }) {
  const camera = view.contentWindow?.__viserMutable?.camera;
  if (!camera) return null;
  const m = camera.matrixWorld.elements, project = camera.projectionMatrix.elements;
  const across = (2 * x - 1) / project[0], up = (1 - 2 * y) / project[5];
  // Columns of m: right, up, back, place. Three's axes are right, up, back of the rig's world.
  const world = (at) => [-at[2], -at[0], at[1]];
  const column = (i) => [0, 1, 2].map((k) => m[4 * i + k]);
  const ray = [0, 1, 2].map((k) => across * m[k] + up * m[4 + k] - m[8 + k]);
  return { eye: world(column(3)), ahead: world(column(2)).map((value) => -value), ray: world(ray) };
}

/** Where a ray meets the plane normal * (point - eye) = away; null behind the viewer. */
function meet({ eye, ray }, normal, away) {
  const towards = dot(ray, normal);
  if (towards <= 0) return null;
  const at = eye.map((value, i) => value + (ray[i] * away) / towards);
  return at.every(Number.isFinite) ? at : null;
}

/** The eyes seem to look at the pointer: they look at a point on the viewer's line of sight to it. */
function gazeOrder(seen) {
  const toHead = sub(now.state.gaze.head_m, seen.eye);
  if (Math.hypot(...toHead) < NEAREST_M) return null;
  const at = meet(seen, toHead, TOWARDS_HEAD * dot(toHead, toHead));
  return at && { do: "look_at", p_world_m: at, pointer: true };
}

/** The fist follows in the plane through its guard, parallel to the screen, within its box. */
function opponentOrder(seen) {
  const away = dot(seen.ahead, sub(GUARD_M, seen.eye));
  const at = away > NEAREST_M ? meet(seen, seen.ahead, away) : null;
  const within = (value, i) => Math.min(Math.max(value, OPPONENT_BOX_M[i][0]), OPPONENT_BOX_M[i][1]);
  return at && { do: "opponent", p_world_m: at.map(within) };
}

setInterval(() => {
  const time = performance.now(), { state } = now;
  const kind = state?.control_source.kind;
  if (kind === "pointer") takesOver = false;
  if (!state || state.stopped || isLost() || document.hidden) return;
  if (!pointer || !(following() || boxing())) return;
  if (!held && time - movedAt > RESTED_MS) return;
  if (!boxing() && !takesOver && !FREE.includes(kind)) return;
  if (!moved && time - sentAt < AGAIN_MS) return;
  moved = false;
  sentAt = time;
  const seen = viewer(pointer);
  const message = seen && (boxing() ? opponentOrder(seen) : gazeOrder(seen));
  if (message) tell(message);
}, POINT_MS);

// On from the start if no real head would turn away from the people in front of it.
let begun = false;
on("rig", ({ emulated, opponent }) => {
  if (!begun) $("#pointer").setAttribute("aria-pressed", String(Boolean(emulated)));
  begun = true;
  $("#opponent").hidden = !opponent;
});

$("#pointer").addEventListener("click", () => { takesOver = toggle($("#pointer")); });
$("#opponent").addEventListener("click", () => {
  if (toggle($("#opponent"))) say("Look at both or over its shoulder, and point at the opponent.");
});

function watch() {
  const inside = view.contentWindow;
  for (const kind of ["pointermove", "pointerdown"]) inside.addEventListener(kind, point, true);
  for (const kind of ["pointerup", "pointercancel"]) {
    inside.addEventListener(kind, (event) => {
      if (event.pointerType === "touch" && event.isPrimary) leave();
    }, true);
  }
  // Else the browser scrolls by the finger, and sends no more of its places.
  inside.addEventListener("touchmove", (event) => {
    if ((following() || boxing()) && event.touches.length === 1) event.preventDefault();
  }, { passive: false });
  inside.document.documentElement.addEventListener("pointerleave", leave);
  load();
}
view.addEventListener("load", watch);
if (view.contentDocument?.readyState === "complete") watch();
