// Panel: parameters that a running rig applies; the others are changed in its file.

import { ask, now, on } from "/rig/connection.js";
import { buttons, checkbox, make, markUnsaved, section, slider, textField } from "/rig/elements.js";
import { order, say } from "/rig/orders.js";
import { count } from "/rig/words.js";

/** Parameters with which the drawer opens, and their plain names. */
const FIRST = {
  "gaze.scanpath.rate_scale": "liveliness",
  "gaze.scanpath.spot_height_mm": "height on the face",
  "gaze.lids.blinks_per_min": "blinks",
  "gaze.head.eye_only_range_deg": "range of the eyes alone",
};
const LIVE = "next tick";
const STEPS = 100; // of a slider
const FAR = 20; // ratio of range to value above which a number is typed
const READ_MS = 500; // shortest time between two readings of all values

export default {
  drawer: "tune",
  every_ms: 300,
  build(place) {
    const first = make("div"), all = section("all live parameters", false);
    const status = make("div"), file = make("div", { className: "note" });
    const groups = make("div");
    const keep = buttons("", ["save", "revert to the file"], (name) => (
      name === "save" ? save(null) : revert()));
    const saveAs = textField(
      { name: "save as", enterOnly: true, hint: "a new .yaml file in the rig's folder; Enter saves" },
      (name) => save(name.trim() || null),
    );
    all.body.append(status, file, keep.node, saveAs.node, groups);
    place.append(first, all.node);
    on("rig", async () => {
      const parameters = (await ask({ do: "parameters" })).filter(({ live }) => live === LIVE);
      values = await ask({ do: "get" });
      controls.clear();
      build(parameters, first, groups);
      await read(status);
    });
    let version;
    setInterval(() => {
      if (!controls.size || now.run?.version === version) return;
      version = now.run.version;
      read(status);
    }, READ_MS);
    return ({ rig }) => { file.textContent = rig?.path ?? ""; };
  },
};

const controls = new Map(); // key -> controls
let values = {}; // in force, by key

/** Show the values in force, and which of them are not in the rig's file. */
async function read(status) {
  let unsaved;
  [values, unsaved] = await Promise.all([ask({ do: "get" }), ask({ do: "unsaved" })]);
  const changed = new Set(unsaved.map(({ key }) => key));
  for (const [key, list] of controls) {
    for (const control of list) {
      control.show(values[key]);
      markUnsaved(control, changed.has(key));
    }
  }
  status.textContent = `${count(controls.size, "parameter")}, `
    + (changed.size ? `● ${changed.size} not saved` : "all saved");
}

async function save(path) {
  const done = await order({ do: "save", path });
  if (done) say(`saved in ${done.path}${done.backup ? `, what was there is in ${done.backup}` : ""}`);
}

async function revert() {
  const done = await order({ do: "revert" });
  if (done) say(done.notes?.join("\n") || "all is as in the file again");
}

// --- controls -----------------------------------------------------------------------------------

function build(parameters, first, groups) {
  const bodies = new Map(); // group -> list of nodes
  const opening = [];
  for (const param of parameters) {
    const group = param.group ? param.group.split(".").slice(0, 2).join(".") : "rig";
    if (!bodies.has(group)) bodies.set(group, []);
    const control = controlOf(param, values[param.key], param.key.split(".").slice(-2).join("."));
    bodies.get(group).push(control.node);
    controls.set(param.key, [control]);
    if (!(param.key in FIRST)) continue;
    const plain = controlOf(param, values[param.key], FIRST[param.key]);
    controls.get(param.key).push(plain);
    opening[Object.keys(FIRST).indexOf(param.key)] = plain.node;
  }
  first.replaceChildren(...opening.filter(Boolean));
  groups.replaceChildren(...[...bodies].map(([group, nodes]) => {
    const fold = section(group, false);
    fold.body.append(...nodes);
    return fold.node;
  }));
}

/** Control of a parameter: a checkbox, a menu, a slider or a text field. */
function controlOf(param, value, name) {
  const { key, kind, optional, choices, low, high, unit } = param;
  const hint = hintOf(param);
  const set = (next) => put(key, next);
  if (!optional && kind === "bool") return checkbox({ name, value, hint }, set);
  if (!optional && kind === "choice") return buttons(name, choices, set, hint);
  const bounded = typeof low === "number" && typeof high === "number";
  const isSlider = !optional && kind === "number" && bounded
    && high - low <= FAR * Math.abs(value || high);
  if (isSlider) {
    const step = 10 ** Math.floor(Math.log10((high - low) / STEPS));
    return slider({ name, unit, low, high, step, value, hint }, set);
  }
  const control = textField(
    { name: unit ? `${name} (${unit})` : name, value: textOf(param, value), hint },
    (text) => set(valueOf(param, text)),
  );
  return { node: control.node, show: (next) => control.show(textOf(param, next)) };
}

/** Set a value; one that the rig refuses is shown as it was. */
async function put(key, value) {
  const done = await order({ do: "set", changes: { [key]: value } });
  if (!done) for (const control of controls.get(key)) control.show(values[key]);
  const later = done?.notes?.filter((text) => text.includes("next start")) ?? [];
  if (later.length) say(later.join("\n"));
}

function hintOf({ key, description, low, high, unit, kind, default: usual, optional }) {
  const parts = [description ? `${key}: ${description}` : key];
  const after = unit ? ` ${unit}` : "";
  if (low !== null && high !== null) parts.push(`from ${low} to ${high}${after}`);
  if (usual !== null || optional) parts.push(`default ${textOf({ kind }, usual)}${after}`);
  return parts.join("; ");
}

const isText = ({ kind }) => kind === "text" || kind === "choice";

/** A value as a person would type it: text as it is, other values as in the file. */
function textOf(param, value) {
  return typeof value === "string" && isText(param) ? value : JSON.stringify(value);
}

/** The value that a person typed; the rig refuses a text that is none. */
function valueOf(param, text) {
  const trimmed = text.trim();
  if (param.optional && ["", "null"].includes(trimmed)) return null;
  if (isText(param)) return trimmed;
  try { return JSON.parse(trimmed); } catch { return trimmed; }
}
