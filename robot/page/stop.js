// The red button that is always there, whatever the rest of the page does.
//
// It stands outside of everything that viser draws, and talks to the rig over the page's
// door by requests of its own. The space bar does the same, unless somebody types. A click
// into the camera picture makes the head look there.

(() => {
  "use strict";

  const SILENT_AFTER_MS = 3000; // the door gives a sign of life every second
  const RED = "#c92a2a";
  const css = `
    #rig-stop-bar { position: fixed; left: 50%; bottom: 14px; transform: translateX(-50%);
      z-index: 2147483647; display: flex; flex-direction: column-reverse; gap: 10px;
      align-items: center; width: max-content; max-width: calc(100vw - 28px);
      font: 600 15px/1.3 system-ui, sans-serif; color: #fff; pointer-events: none }
    #rig-stop-bar > * { pointer-events: auto; border-radius: 10px;
      box-shadow: 0 2px 10px rgba(0, 0, 0, .35) }
    #rig-stop-bar button { font: inherit; color: #fff; border: 0; border-radius: 10px;
      cursor: pointer; padding: 0 18px }
    #rig-stop { background: ${RED}; min-width: 150px; min-height: 72px;
      font-size: 26px !important; letter-spacing: 2px }
    #rig-stop:active { background: #801515 }
    #rig-stop small { display: block; font: 400 11px system-ui, sans-serif; letter-spacing: 0 }
    #rig-words { background: #212529; padding: 10px 14px; display: flex; gap: 12px;
      align-items: center; flex-wrap: wrap; max-width: 520px }
    #rig-words[hidden], #rig-stop[hidden] { display: none }
    #rig-words button { background: #2b8a3e; min-height: 40px }
    #rig-words button.no { background: #495057 }
    #rig-words.alarm { background: ${RED} }
    img.rig-camera { cursor: crosshair }`;

  const bar = document.createElement("div");
  bar.id = "rig-stop-bar";
  bar.innerHTML = `
    <button id="rig-stop" type="button">STOP<small>or the space bar</small></button>
    <div id="rig-words" role="status" hidden></div>`;
  const stop = bar.querySelector("#rig-stop");
  const words = bar.querySelector("#rig-words");

  let state = { stopped: "", silent: false };
  let heardAt = performance.now();
  let confirming = false;
  let failed = "";

  async function ask(what) {
    const answer = await fetch("/rig/ask", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(what),
      keepalive: true,
    });
    if (!answer.ok) throw new Error((await answer.text()).trim());
  }

  function halt(by) {
    confirming = false;
    ask({ order: "stop", why: by })
      .then(() => { failed = ""; })
      .catch((error) => { failed = `STOP did not reach the rig (${error.message})`; })
      .finally(draw);
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
    ask({ order: "resume" })
      .catch((error) => { failed = `resume did not reach the rig (${error.message})`; })
      .finally(draw);
  }

  function sure(yes) {
    confirming = yes;
    draw();
  }

  // A servo that tells nothing cannot be taken hold of where it is.
  function how() {
    const blind = state.blind;
    if (!blind) return "The torque comes on where the joints are.";
    const who = blind === 1 ? "1 joint without feedback jumps to its place"
      : `${blind} joints without feedback jump to their places`;
    return `${who} at full speed.`;
  }

  // What there is to say, most urgent first: [text, alarm, buttons].
  function saying() {
    if (state.recording) return ["A recording: nothing here moves or stops a rig.", false, []];
    const lost = performance.now() - heardAt > SILENT_AFTER_MS;
    if (failed) return [`${failed}. Use the emergency stop of the rig.`, true, []];
    if (lost) return ["No connection: STOP does nothing here. Use the emergency stop.", true, []];
    if (state.silent) return ["The rig is silent: use its emergency stop.", true, []];
    if (!state.stopped) return ["", false, []];
    if (confirming) {
      return [`Fingers out? ${how()}`, false, [
        button("Yes, resume", "yes", resume),
        button("No", "no", () => sure(false)),
      ]];
    }
    return [`Torque is off: ${state.stopped}.`, false, [
      button("Resume …", "yes", () => sure(true)),
    ]];
  }

  let drawn = "";
  function draw() {
    stop.hidden = Boolean(state.recording);
    const [text, alarm, buttons] = saying();
    const now = [text, alarm, ...buttons.map((b) => b.textContent)].join("|");
    if (now === drawn) return; // a button that is being pressed stays where it is
    drawn = now;
    words.hidden = !text;
    words.className = alarm ? "alarm" : "";
    const line = document.createElement("span");
    line.textContent = text;
    words.replaceChildren(line, ...buttons);
  }

  function listen() {
    const events = new EventSource("/rig/state");
    events.onmessage = (event) => {
      heardAt = performance.now();
      const before = state.stopped;
      state = { stopped: "", silent: false, ...JSON.parse(event.data) };
      if (state.stopped !== before) { confirming = false; failed = ""; }
      draw();
    };
    events.onerror = () => {
      if (events.readyState !== EventSource.CLOSED) return; // it tries again by itself
      setTimeout(listen, 1000);
    };
  }

  const TEXT = new Set(["text", "search", "number", "password", "email", "url", "tel", ""]);
  function typing(where) {
    if (!(where instanceof HTMLElement)) return false;
    if (where.isContentEditable) return true;
    if (where instanceof HTMLTextAreaElement) return !where.readOnly;
    if (where instanceof HTMLInputElement) {
      return TEXT.has(where.getAttribute("type") ?? "") && !where.readOnly;
    }
    return false;
  }

  // Caught before anybody else sees it: a space would also press the button in focus.
  function key(event) {
    if (event.code !== "Space" || state.recording || typing(event.target)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.type === "keydown" && !event.repeat) halt("somebody pressed the space bar");
  }

  // The camera picture is the one that is called so, in the panel or laid out large.
  function isCamera(image) {
    const title = image.closest(".mantine-Modal-content")?.querySelector(".mantine-Modal-title")
      ?? image.parentElement?.previousElementSibling;
    return /^camera\b/.test(title?.textContent?.trim() ?? "");
  }

  function pick(event) {
    const image = event.target;
    if (!(image instanceof HTMLImageElement) || !isCamera(image)) return;
    const box = image.getBoundingClientRect();
    ask({ pick: {
      x: (event.clientX - box.left) / box.width,
      y: (event.clientY - box.top) / box.height,
    } }).catch((error) => { failed = `the click did not reach the rig (${error.message})`; draw(); });
  }

  function hover(event) {
    if (event.target instanceof HTMLImageElement && isCamera(event.target)) {
      event.target.classList.add("rig-camera");
    }
  }

  function begin() {
    const style = document.createElement("style");
    style.textContent = css;
    document.head.append(style);
    document.body.append(bar);
    // Pressed, not released: a hand that trembles may leave the button before it lets go.
    stop.addEventListener("pointerdown", () => halt("somebody pressed STOP on the page"));
    stop.addEventListener("click", (event) => { // a screen reader or Enter clicks only
      if (event.detail === 0) halt("somebody pressed STOP on the page");
    });
    document.addEventListener("click", pick, true);
    document.addEventListener("mouseover", hover, true);
    setInterval(draw, 500);
    listen();
  }

  for (const type of ["keydown", "keyup", "keypress"]) window.addEventListener(type, key, true);
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
