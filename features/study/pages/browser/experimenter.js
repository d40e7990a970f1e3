// The experimenter's page. The connection, STOP and its words are those of stop.js.

const element = (id) => document.getElementById(id);
const dialog = element("ask");

const HEAD = {
  none: "none, films are shown", alive: "alive", late: "silent", fault: "fault", stopped: "torque is off",
};
const WELL = new Set(["none", "alive"]);
const ENDED = {
  finished: "The participant has finished", withdrawn: "The participant has left",
  excluded: "The participant is excluded", declined: "The participant does not take part",
};

const SILENT_AFTER_MS = 3000; // there is a sign of life every second

let session = null;
let heardAt = performance.now();

setInterval(() => {
  if (performance.now() - heardAt > SILENT_AFTER_MS) set("doing", "No connection to the study: is its program running?");
}, 1000);

window.addEventListener("rig-state", ({ detail }) => {
  if (!detail.session) return;
  heardAt = performance.now();
  session = { ...detail.session, head: detail.head, head_says: detail.head_says };
  element("trouble").textContent = detail.trouble;
  element("trouble").hidden = !detail.trouble;
  draw();
});

// A text that is the same is not set again, so that it is not read out each second.
function set(id, text) {
  if (element(id).textContent !== text) element(id).textContent = text;
}

function draw() {
  const now = session;
  set("participant", now.participant);
  set("doing", now.outcome ? ENDED[now.outcome] : `${now.paused ? "Paused: the participant" : "The participant"} ${now.doing}`);
  set("number", number(now));
  const done = now.trial === null ? (now.outcome === "finished" ? now.of : 0) : Math.max(0, now.trial - 1);
  element("along").setAttribute("aria-valuemax", now.of);
  element("along").setAttribute("aria-valuenow", done);
  element("along").firstElementChild.style.width = `${100 * done / Math.max(1, now.of)}%`;
  condition(now);
  head(now);
  set("answers", String(now.answers));
  set("elapsed", clock(now.elapsed_s));
  const shown = now.showing ? `, shown for ${Math.floor(now.showing_s)} s` : "";
  set("attempt", now.condition ? `${now.attempt + 1}${shown}` : "–");
  set("pause", now.paused ? "Go on" : "Pause");
  for (const id of ["pause", "repeat", "exclude"]) element(id).disabled = Boolean(now.outcome);
  element("repeat").disabled ||= !now.showing;
  set("end", now.outcome ? "End …" : "End for now …");
}

function number({ trial, of, outcome }) {
  if (outcome) return "Over";
  if (trial === null) return `${of} trials`;
  return trial > 0 ? `Trial ${trial} of ${of}` : "Practice";
}

function condition({ condition: key, label }) {
  const shown = `${key}|${label}`;
  const place = element("condition");
  if (place.dataset.shown === shown) return;
  place.dataset.shown = shown;
  const name = document.createElement("code");
  name.textContent = key;
  place.replaceChildren(...(key ? [name, label] : ["No presentation now"]));
}

// Who stopped it stands beside STOP; a fault holds the session until it goes on.
function head(now) {
  const well = WELL.has(now.head);
  const wrong = now.head === "stopped" ? "" : now.head_says;
  const held = well && now.fault && now.fault !== now.head_says ? `; paused, as it was: ${now.fault}` : "";
  element("head").classList.toggle("bad", !well || Boolean(wrong));
  set("head", `${HEAD[now.head]}${wrong ? `: ${wrong}` : ""}${held}`);
}

function clock(seconds) {
  const whole = Math.floor(seconds);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return `${h ? `${h}:` : ""}${String(m).padStart(h ? 2 : 1, "0")}:${String(s).padStart(2, "0")}`;
}

async function ask(what, words) {
  try {
    await window.rig.ask(what);
    set("said", words);
  } catch (error) {
    set("said", `Not done: ${error.message}`);
  }
}

function question(title, text, yes, reason, does) {
  element("ask-title").textContent = title;
  element("ask-text").textContent = text;
  element("ask-reason").hidden = !reason;
  element("reason").value = "";
  const button = element("ask-yes");
  button.textContent = yes;
  button.onclick = () => {
    const why = element("reason").value.trim();
    if (reason && !why) return element("reason").focus();
    dialog.close();
    does(why);
  };
  dialog.showModal();
  if (reason) element("reason").focus();
}

element("reason").addEventListener("keydown", (event) => {
  if (event.key !== "Enter") return;
  event.preventDefault(); // Enter would press "No"
  element("ask-yes").click();
});
element("pause").addEventListener("click", () => {
  if (session?.paused) ask({ do: "go on" }, "The session goes on.");
  else ask({ do: "pause" }, "Paused: no presentation begins until you press “Go on”.");
});
element("repeat").addEventListener("click", () => {
  ask({ do: "repeat" }, "The presentation begins again when the participant is ready.");
});
element("exclude").addEventListener("click", () => {
  question(
    "Exclude this participant?",
    "The session ends for good. What was answered stays on disk, and the report counts it as excluded with this reason.",
    "Exclude", true, (why) => ask({ do: "exclude", why }, "The participant is excluded."),
  );
});
element("end").addEventListener("click", () => {
  if (session?.outcome) return ask({ do: "end" }, "The program ends.");
  question(
    "End for now?",
    "The program ends. Everything answered is on disk, and the session goes on where it was when it is started again with the same code.",
    "End", false, () => ask({ do: "end" }, "The program ends."),
  );
});
