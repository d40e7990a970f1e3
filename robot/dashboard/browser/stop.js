// The STOP button, which works whatever the rest of the page does.
//
// It needs none of the page's other scripts, and reaches the rig through the page's door by its own
// connection, which is open before it is needed. The space bar does the same, also in the frame of
// the view, unless the user types. A stop is sent again until the rig confirms it.
//
// Messages of the connection become an event "rig-state" of the window for the other scripts. They
// send requests by window.rig: ask(what) waits for an answer, tell(what) does not. The button is
// hidden for films without a head ("headless").

(() => {
  "use strict";

  const SILENT_AFTER_MS = 3000; // the door sends a heartbeat every second
  const AGAIN_MS = 250;

  let stop = null; // the button and its message, once the document has them
  let words = null;

  const QUIET = { stopped: "", silent: false, you: "" };
  let state = QUIET;
  let line = null; // the open connection
  let heardAt = performance.now();
  let why_lost = "";
  let confirming = false;
  let failed = "";
  let stopping = null; // a stop that the rig has not confirmed yet
  let posting = false;

  async function ask(what, signal) {
    const answer = await fetch("/rig/ask", {
      signal,
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(what),
      keepalive: true,
    });
    if (!answer.ok) throw new Error((await answer.text()).trim());
  }

  function halt(by) {
    confirming = false;
    failed = "";
    const first = !stopping;
    stopping = { do: "stop", why: by };
    draw();
    if (first) push(1);
  }

  // Send the stop until it is confirmed: over the open connection, and by a separate request if
  // there is none or it does not answer.
  function push(attempt) {
    if (!stopping) return;
    const standing = line && line.readyState === WebSocket.OPEN;
    if (standing) line.send(JSON.stringify(stopping));
    if (!posting && (!standing || attempt > 1)) {
      posting = true;
      ask(stopping, AbortSignal.timeout(2000))
        .then(() => answered(204, ""))
        .catch((error) => answered(0, error.message))
        .finally(() => { posting = false; });
    }
    setTimeout(() => push(attempt + 1), AGAIN_MS);
  }

  function answered(status, why) {
    if (status === 204) { stopping = null; failed = ""; }
    else if (stopping) failed = `STOP has not reached the rig yet (${why}), it is sent again`;
    draw();
  }

  function button(text, kind, does) {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.className = kind;
    made.addEventListener("click", does);
    return made;
  }

  function resume() {
    confirming = false;
    ask({ do: "resume", confirmed: true }) // a person confirmed
      .catch((error) => { failed = `resume did not reach the rig (${error.message})`; })
      .finally(draw);
  }

  function sure(yes) {
    confirming = yes;
    draw();
  }

  // A servo without feedback cannot be held at its present angle.
  function how() {
    const without_feedback = state.without_feedback;
    if (!without_feedback) return "The torque comes on where the joints are.";
    const who = without_feedback === 1 ? "1 joint without feedback jumps to its place"
      : `${without_feedback} joints without feedback jump to their places`;
    return `${who} at full speed.`;
  }

  // Name another browser that stopped the rig: its user may have a hand in the mechanism.
  function question() {
    const other = !state.stopped.includes(`(${state.you})`);
    return other ? `Not stopped here: ${state.stopped}. Is no hand in the mechanism? ${how()}`
      : `Fingers out? ${how()}`;
  }

  // The message, most urgent first: [text, alarm, buttons].
  function saying() {
    if (state.headless) return ["", false, []];
    const lost = performance.now() - heardAt > SILENT_AFTER_MS;
    if (failed) return [`${failed}. Use the emergency stop of the rig.`, true, []];
    if (lost) return [why_lost || NO_CONNECTION, true, []];
    if (state.silent) return ["The rig is silent: use its emergency stop.", true, []];
    if (!state.stopped) return ["", false, []];
    if (confirming) {
      return [question(), false, [
        button("Yes, resume", "yes", resume),
        button("No", "no", () => sure(false)),
      ]];
    }
    return [`Torque is off: ${state.stopped}.`, false, [
      button("Resume …", "yes", () => sure(true)),
    ]];
  }

  const NO_CONNECTION = "No connection: STOP does nothing here. Use the emergency stop.";
  const NOT_IN = "This page is of an earlier run, and STOP does nothing here: open the address "
    + "that the rig's terminal shows.";
  let drawn = "";
  function draw() {
    if (!stop) return;
    stop.hidden = Boolean(state.headless);
    stop.classList.toggle("going", Boolean(stopping));
    const label = stopping ? "stopping…" : "STOP";
    if (stop.firstChild.textContent !== label) stop.firstChild.textContent = label;
    const [text, alarm, buttons] = saying();
    const now = [text, alarm, ...buttons.map((b) => b.textContent)].join("|");
    if (now === drawn) return; // keep a button that is being pressed
    drawn = now;
    words.hidden = !text;
    words.className = alarm ? "alarm" : "";
    const line = document.createElement("span");
    line.textContent = text;
    words.replaceChildren(line, ...buttons);
  }

  function listen() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const mine = new WebSocket(`${scheme}://${location.host}/rig/line`);
    line = mine;
    mine.onmessage = (event) => {
      const said = JSON.parse(event.data);
      if (said.answer) return answered(said.answer, said.words);
      heardAt = performance.now();
      why_lost = "";
      const before = state.stopped;
      state = { ...QUIET, ...said.state };
      if (state.stopped !== before) { confirming = false; failed = ""; }
      draw();
      window.dispatchEvent(new CustomEvent("rig-state", { detail: state }));
    };
    mine.onclose = () => {
      line = null;
      setTimeout(listen, 500);
      // A refused connection has no reason.
      fetch("/rig/stop.js", { cache: "no-store", signal: AbortSignal.timeout(2000) })
        .then((answer) => { why_lost = answer.status === 403 ? NOT_IN : ""; })
        .catch(() => { why_lost = ""; });
    };
  }

  const TEXT = new Set(["text", "search", "number", "password", "email", "url", "tel"]);
  // By name: elements of a frame are not instances of this window's classes.
  function typing(where) {
    if (where.isContentEditable) return true;
    if (where.tagName === "TEXTAREA") return !where.readOnly;
    return where.tagName === "INPUT" && TEXT.has(where.type) && !where.readOnly;
  }

  // Caught before other handlers see it: a space would also press the button in focus.
  function key(event) {
    if (event.code !== "Space" || stop?.hidden || typing(event.target)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.type === "keydown" && !event.repeat) halt("the space bar was pressed on the page");
  }

  function tell(what) {
    if (line && line.readyState === WebSocket.OPEN) line.send(JSON.stringify(what));
  }

  function begin() {
    stop = document.getElementById("rig-stop");
    words = document.getElementById("rig-words");
    // Pressed, not released: a hand that trembles may leave the button before it lets go.
    stop.addEventListener("pointerdown", () => halt("STOP was pressed on the page"));
    stop.addEventListener("click", (event) => { // a screen reader or Enter clicks only
      if (event.detail === 0) halt("STOP was pressed on the page");
    });
    setInterval(draw, 500);
    draw();
  }

  function listenForKeys(where) {
    for (const type of ["keydown", "keyup", "keypress"]) where.addEventListener(type, key, true);
  }

  window.rig = { ask, tell };
  listenForKeys(window);
  document.addEventListener("load", (event) => { // that of a frame does not bubble
    if (event.target.tagName === "IFRAME") listenForKeys(event.target.contentWindow);
  }, true);
  listen();
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
