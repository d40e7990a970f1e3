// The STOP button, which works whatever the other scripts of the page do.
//
// A stop goes over the connection that is already open, and by a separate request if there is none
// or it does not answer. It is sent again until the rig confirms it. The space bar does the same,
// also in the frame of the view, unless the user types.

import { ask, isLost, isOpen, now, on } from "/rig/connection.js";

const AGAIN_MS = 250, REQUEST_MS = 2000;
const LOST = "No connection: STOP does nothing here. Use the emergency stop.";
const EARLIER_RUN = "This page is of an earlier run, and STOP does nothing here: open the address "
  + "that the rig's terminal shows.";

const stop = document.querySelector("#rig-stop"), words = document.querySelector("#rig-words");
let stopping = null; // a stop that the rig has not confirmed yet
let posting = false, confirming = false;
let failed = "", lost = LOST, shown = "";

function halt(why) {
  const first = !stopping;
  confirming = false;
  failed = "";
  stopping = { do: "stop", why };
  draw();
  if (first) push(1);
}

/** Send the stop, again and again until it is confirmed. */
function push(attempt) {
  if (!stopping) return;
  if (!isOpen() || attempt > 1) post();
  if (isOpen()) ask(stopping).then(confirmed, refused);
  setTimeout(() => push(attempt + 1), AGAIN_MS);
}

async function post() {
  if (posting) return;
  posting = true;
  try {
    const answer = await fetch("/api/v1/do", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(stopping),
      keepalive: true,
      signal: AbortSignal.timeout(REQUEST_MS),
    });
    const { refused: why, failed: fault } = await answer.json();
    if (why || fault) throw new Error(why || fault);
    confirmed();
  } catch (error) {
    refused(error);
  } finally {
    posting = false;
  }
}

function confirmed() {
  stopping = null;
  failed = "";
  draw();
}

function refused(error) {
  if (stopping) failed = `STOP has not reached the rig yet (${error.message}), it is sent again`;
  draw();
}

function resume() {
  confirming = false;
  ask({ do: "resume", confirmed: true }) // a person has confirmed
    .then((done) => { failed = done?.reply?.refused ? `not resumed: ${done.reply.refused}` : ""; })
    .catch((error) => { failed = `resume did not reach the rig (${error.message})`; })
    .finally(draw);
}

// --- the message next to the button -------------------------------------------------------------

/** What to ask before the torque is switched on again. */
function question() {
  const { stopped, joints } = now.state;
  const jumping = Object.values(joints).filter((joint) => joint.estimated).length;
  // A servo without feedback cannot be held at its present angle.
  const how = jumping === 0 ? "The torque comes on where the joints are."
    : jumping === 1 ? "1 joint without feedback jumps to its place at full speed."
      : `${jumping} joints without feedback jump to their places at full speed.`;
  // The user of another browser may have a hand in the mechanism.
  return stopped.includes(`(${now.you})`) ? `Fingers out? ${how}`
    : `Not stopped here: ${stopped}. Is no hand in the mechanism? ${how}`;
}

/** The message, most urgent first: [text, whether it is an alarm, buttons]. */
function message() {
  if (failed) return [`${failed}. Use the emergency stop of the rig.`, true, []];
  if (isLost()) return [lost, true, []];
  if (now.silent) return ["The rig is silent: use its emergency stop.", true, []];
  if (!now.state?.stopped) return ["", false, []];
  if (!confirming) {
    return [`Torque is off: ${now.state.stopped}.`, false, [["Resume …", "yes", () => sure(true)]]];
  }
  return [question(), false, [["Yes, resume", "yes", resume], ["No", "no", () => sure(false)]]];
}

function sure(yes) {
  confirming = yes;
  draw();
}

function draw() {
  stop.classList.toggle("going", Boolean(stopping));
  const label = stopping ? "stopping…" : "STOP";
  if (stop.firstChild.textContent !== label) stop.firstChild.textContent = label;
  const [text, alarm, buttons] = message();
  const content = [text, alarm, ...buttons.map(([name]) => name)].join("|");
  if (content === shown) return; // keep a button that is being pressed
  shown = content;
  words.hidden = !text;
  words.className = alarm ? "alarm" : "";
  const line = document.createElement("span");
  line.textContent = text;
  words.replaceChildren(line, ...buttons.map(([name, kind, act]) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.className = kind;
    button.addEventListener("click", act);
    return button;
  }));
}

// --- the button and the space bar ---------------------------------------------------------------

const TEXT = new Set(["text", "search", "number", "password", "email", "url", "tel"]);
// By name: elements of a frame are not instances of this window's classes.
function isTyping(target) {
  if (target.isContentEditable) return true;
  if (target.tagName === "TEXTAREA") return !target.readOnly;
  return target.tagName === "INPUT" && TEXT.has(target.type) && !target.readOnly;
}

// Caught before other handlers see it: a space would also press the button in focus.
function key(event) {
  if (event.code !== "Space" || isTyping(event.target)) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  if (event.type === "keydown" && !event.repeat) halt("the space bar was pressed on the page");
}

function listenForKeys(target) {
  for (const type of ["keydown", "keyup", "keypress"]) target.addEventListener(type, key, true);
}

// Pressed, not released: a hand that trembles may leave the button before it lets go.
stop.addEventListener("pointerdown", () => halt("STOP was pressed on the page"));
stop.addEventListener("click", (event) => { // a screen reader or Enter clicks only
  if (event.detail === 0) halt("STOP was pressed on the page");
});
listenForKeys(window);
const view = document.querySelector("#view");
view.addEventListener("load", () => listenForKeys(view.contentWindow));
if (view.contentDocument?.readyState === "complete") listenForKeys(view.contentWindow);

let stoppedBefore = "";
on("state", ({ stopped }) => {
  if (stopped !== stoppedBefore) { confirming = false; failed = ""; }
  stoppedBefore = stopped;
  lost = LOST;
  draw();
});
on("silent", draw);
on("closed", async () => { // a refused connection has no reason
  const answer = await fetch("/rig/stop.js", {
    cache: "no-store", signal: AbortSignal.timeout(REQUEST_MS),
  }).catch(() => null);
  lost = answer?.status === 403 ? EARLIER_RUN : LOST;
});
setInterval(draw, 500);
draw();
