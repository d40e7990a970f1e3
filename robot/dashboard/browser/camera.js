// What the camera sees: its pictures, where the head looks in them, and what was found.
//
// Headline and ring show the same moment: now.shown is the state at the capture of the picture.

import { isSilent, now, on } from "/rig/connection.js";
import { make, showAge } from "/rig/elements.js";
import { order } from "/rig/orders.js";
import { isLed, personOf } from "/rig/words.js";

const PICTURE_EVERY_MS = 700; // without a picture for this long the newest state is shown
const KEPT_S = 2;
const LATEST_S = 0.8; // a moment older than this is not kept while the eyes are under way
const STEP = 0.04; // of the cross that the arrow keys move
const WIDTH = 640;

/** Layers over the picture, chosen in the drawer Watch. */
export const layers = { gaze: true, faces: false };

const canvas = make("canvas", { tabIndex: 0, className: "pick", width: WIDTH, height: 400 });
const mark = make("span", { className: "mark", hidden: true });
const frame = make("div", { className: "picture", hidden: true }, canvas, mark);
canvas.setAttribute("role", "button");
canvas.setAttribute("aria-label", "what the camera sees");
canvas.title = "click: the head looks there (or move the cross by the arrow keys, and Enter)";
document.querySelector("#camera").append(frame);

// --- the moment that is shown -------------------------------------------------------------------

const states = []; // of the last seconds, oldest first
const watchers = [];
let picture = null, paintedAt = -Infinity;

/** Call a function with the state of each moment that is shown. */
export function onShown(handle) {
  watchers.push(handle);
}

/** Whether the eyes are at the named part: a target is chosen some time before the saccade to it. */
function hasArrived({ gaze, people }) {
  const parts = people.find(({ id }) => id === personOf(gaze))?.parts_m;
  if (!gaze.part || !parts) return gaze.phase !== "saccade";
  const away = (part) => Math.hypot(...parts[part].map((value, i) => value - gaze.point_m[i]));
  return Object.keys(parts).every((part) => away(gaze.part) <= away(part));
}

function showMoment(state) {
  const waits = now.shown && !isLed(now.shown) && !isLed(state) && !hasArrived(state);
  const old = now.shown && Math.abs(state.t_s - now.shown.t_s) > LATEST_S;
  if (!waits || old) now.shown = state;
  for (const watch of watchers) watch(now.shown);
}

on("state", (state) => {
  if (state.t_s < states.at(-1)?.t_s) states.length = 0;
  states.push(state);
  while (states[0].t_s < state.t_s - KEPT_S) states.shift();
  if (performance.now() - paintedAt > PICTURE_EVERY_MS) showMoment(state);
});

on("picture", async (next, image) => {
  const bitmap = image.size ? await createImageBitmap(image) : null;
  if (picture?.number > next.number && picture.captured_s <= next.captured_s) return;
  picture = next;
  paintedAt = performance.now();
  frame.hidden = false;
  draw(bitmap);
  bitmap?.close();
  const distance = ({ t_s }) => Math.abs(t_s - next.captured_s);
  const moment = states.reduce((a, b) => (distance(b) < distance(a) ? b : a), states[0]);
  if (moment) showMoment(moment);
});

// --- drawing ------------------------------------------------------------------------------------

function draw(bitmap) {
  const { width_px, height_px } = picture;
  const scale = Math.min(1, WIDTH / width_px);
  const [width, height] = [width_px, height_px].map((px) => Math.max(1, Math.round(px * scale)));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    document.querySelector("#camera").style.setProperty("--aspect", width / height);
  }
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#262626";
  pen.fillRect(0, 0, width, height);
  if (bitmap) pen.drawImage(bitmap, 0, 0, width, height);
  pen.setTransform(scale, 0, 0, scale, 0, 0); // from here on in pixels of the full picture
  const thin = 1 / scale;
  if (layers.faces) drawFindings(pen, thin);
  if (layers.gaze && picture.gaze_px) drawRing(pen, thin * Math.max(0.5, width / WIDTH));
  pen.setTransform(1, 0, 0, 1, 0, 0);
}

function drawRing(pen, px) {
  const [x, y] = picture.gaze_px;
  for (const [colour, radius, wide] of [["#fafafa", 14, 5], ["#ff8228", 14, 3]]) {
    circle(pen, x, y, radius * px, colour, wide * px);
  }
  pen.fillStyle = "#ff8228";
  pen.beginPath();
  pen.arc(x, y, 3 * px, 0, 7);
  pen.fill();
}

function circle(pen, x, y, radius, colour, wide) {
  pen.strokeStyle = colour;
  pen.lineWidth = wide;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 7);
  pen.stroke();
}

const FOUND = "#5adc78", MOVING = "#3caaff";

function drawFindings(pen, px) {
  pen.font = `${14 * px}px system-ui, sans-serif`;
  const box = ([x, y, wide, high], text, line) => {
    pen.strokeStyle = pen.fillStyle = FOUND;
    pen.lineWidth = line * px;
    pen.strokeRect(x, y, wide, high);
    pen.fillText(text, x, Math.max(14 * px, y - 4 * px));
  };
  for (const { box_px, head_px, confidence } of picture.people ?? []) {
    box(box_px, `person ${confidence.toFixed(2)}`, 1);
    circle(pen, ...head_px, 4 * px, FOUND, px);
  }
  for (const { box_px, landmarks_px, confidence } of picture.faces ?? []) {
    box(box_px, confidence.toFixed(2), 2);
    for (const [x, y] of landmarks_px ?? []) circle(pen, x, y, px, "#fff", 2 * px);
  }
  for (const { kind, centre_px: [x, y], radius_px } of picture.things ?? []) {
    circle(pen, x, y, Math.max(2 * px, radius_px), MOVING, px);
    pen.fillStyle = MOVING;
    pen.fillText(kind, x - radius_px, Math.max(14 * px, y - radius_px - 4 * px));
  }
}

showAge(frame, () => paintedAt);

// --- look at a place in the picture --------------------------------------------------------------

/** Rectangle of the picture in the window, fitted into its element. */
function drawnBox() {
  const box = canvas.getBoundingClientRect();
  const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
  const width = scale * canvas.width, height = scale * canvas.height;
  return {
    left: box.left + (box.width - width) / 2, top: box.top + (box.height - height) / 2, width, height,
  };
}

function lookAt(x, y) {
  if (!picture || isSilent() || !(x >= 0 && x <= 1 && y >= 0 && y <= 1)) return;
  const pixel_px = [x * (picture.width_px - 1), y * (picture.height_px - 1)];
  order({ do: "look_at_pixel", pixel_px, captured_s: picture.captured_s });
}

canvas.addEventListener("click", (event) => {
  if (event.detail === 0) return; // Enter, which has its own handler
  const box = drawnBox();
  lookAt((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
});

let cross = [0.5, 0.5];
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function showCross() {
  const box = drawnBox(), outer = frame.getBoundingClientRect();
  mark.style.left = `${box.left - outer.left + cross[0] * box.width}px`;
  mark.style.top = `${box.top - outer.top + cross[1] * box.height}px`;
  mark.hidden = false;
}

canvas.addEventListener("keydown", (event) => {
  if (event.key === "Enter") return lookAt(...cross);
  const arrow = ARROWS[event.key];
  if (!arrow) return;
  event.preventDefault();
  cross = cross.map((value, i) => Math.min(1, Math.max(0, value + STEP * arrow[i])));
  showCross();
});
canvas.addEventListener("blur", () => { mark.hidden = true; });
