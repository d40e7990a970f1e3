// Panel: health of the rig: the guard, every servo, the loop and the camera.

import { heading, make, note, pill, table } from "/rig/elements.js";
import { count, degrees, spaced } from "/rig/words.js";

const LEVELS = { ok: "ok", limited: "near", hold: "hold", torque_off: "alarm", stopped: "alarm" };
const OLD_S = 0.15; // age of a servo's last answer
const OLD_FRAME_S = 0.5; // the guard stops the neck at three times that age
const HARD_LOAD = 0.9, LATE_SHARE = 0.5;
const QUIET = "torque off";
const SERVO_NOTE = "amber: the guard slows the joint down; red: the joint is stopped, or the servo is "
  + "silent or at fault. silent: ticks without an answer. no feedback: the servo reports neither "
  + "position nor load; a joint that jams or a rod that came off is not noticed";

export default {
  drawer: "health",
  every_ms: 250,
  build(place) {
    place.append(note("waiting for the rig"));
    return ({ state, run, rig }) => {
      if (!rig || !run) return;
      place.replaceChildren(
        guard(state),
        heading("servos"), ...feedback(state), servos(state, run, rig),
        note(SERVO_NOTE), make("div", {}, run.health),
        heading("loop"), ...timing(run.timing),
        heading("camera"), frame(state), make("div", {}, perception(run)),
      );
    };
  },
};

/** The guard's action and reasons, of constant height. */
function guard({ stopped, level, reasons }) {
  const name = stopped ? "stopped" : level;
  const texts = stopped ? [stopped] : level === "limited" ? [reasons.join("; ")] : reasons;
  const lines = texts.filter(Boolean).map((text) => make("div",
    { className: level === "limited" ? "line" : "", title: text, textContent: text }));
  return make("div", { className: "stay" }, pill(`guard: ${name.replace("_", " ")}`, LEVELS[name]), ...lines);
}

/** How many joints have no feedback; empty if all are measured. */
function feedback({ joints }) {
  const all = Object.values(joints), guessed = all.filter((joint) => joint.estimated);
  if (!guessed.length) return [];
  const loose = guessed.filter((joint) => joint.torque === false).length; // a finger can move them
  const where = loose ? `; ${loose === guessed.length ? "all" : loose} without torque: may be anywhere` : "";
  return [make("div", { className: "warn", textContent:
    `${guessed.length} of ${count(all.length, "joint")} without feedback: shown where they should be${where}` })];
}

function servos({ joints }, { unanswered }, rig) {
  const rows = Object.entries(joints).map(([name, joint]) => row(name, joint, unanswered?.[name], rig.joints[name] ?? {}));
  return table(["joint", "angle", "°C", "load", "V", "silent"], rows);
}

/** One servo: values beyond the guard's limits are marked, and the reason is below the name. */
function row(name, joint, unanswered, limits) {
  const late = joint.age_s > OLD_S;
  const remark = joint.fault || (late && `silent for ${Math.min(joint.age_s, 999).toFixed(1)} s`)
    || (joint.torque === false && QUIET) || "";
  const title = make("th", {}, spaced(name));
  if (remark) {
    title.append(make("div", { className: remark === QUIET ? "quiet" : "fault", textContent: remark }));
  }
  const silent = cell(unanswered ?? "-", late ? "over" : "");
  if (joint.estimated) {
    const nothing = make("td", { className: "nothing", colSpan: 4, textContent: "no feedback" });
    return [title, nothing, silent];
  }
  const { temperature_c: heat, load, voltage_v: volts } = joint;
  const { warm_c, hot_c, low_v, high_v, heavy_load } = limits;
  const isKnown = (value) => value !== null && value !== undefined;
  return [
    title,
    cell(`${Math.round(degrees(joint.measured_rad)) + 0}°`),
    cell(isKnown(heat) ? heat.toFixed(0) : "-", heat >= hot_c ? "over" : heat >= warm_c ? "near" : ""),
    cell(isKnown(load) ? `${Math.round(100 * load) + 0} %` : "-",
      Math.abs(load) >= HARD_LOAD ? "over" : Math.abs(load) > heavy_load ? "near" : ""),
    cell(isKnown(volts) ? volts.toFixed(1) : "-",
      isKnown(volts) && (volts < low_v || volts > (high_v ?? Infinity)) ? "near" : ""),
    silent,
  ];
}

const cell = (text, strain = "") => make("td", { className: strain, textContent: text });

function timing(loop) {
  if (!loop) return [note("the loop's times are not known yet")];
  const { rate_hz, latest_ms, overruns, over_s } = loop;
  const late = rate_hz > 0 && latest_ms > (LATE_SHARE * 1000) / rate_hz ? "near" : "";
  return [
    table(["rate", "latest tick", "overruns"], [[
      `${rate_hz.toFixed(1)} Hz`, cell(`${latest_ms.toFixed(2)} ms late`, late),
      cell(overruns, overruns ? "near" : ""),
    ]]),
    note(`over the last ${over_s.toFixed(0)} s`),
  ];
}

/** Age of the newest frame, s; null before the first. */
const frameAge = ({ frame_s, t_s }) => (typeof frame_s === "number" ? t_s - frame_s : null);

function frame(state) {
  const age_s = frameAge(state);
  if (age_s === null) return make("div", {}, "no frame yet");
  const age = make("b", { textContent: `${(1000 * age_s).toFixed(0)} ms` });
  if (age_s >= OLD_FRAME_S) age.className = "warn";
  return make("div", {}, "frame ", age, " old");
}

/** What the rig reports of camera and faces, without the frame's age, which has its own line. */
function perception({ perception: text }) {
  const parts = (text ?? "").split(" | ");
  return parts.filter((part) => !/^(frame |no frame)/.test(part)).join(" | ");
}

/** What keeps the head still, for the banner on top: [title, kind, lines]; null if nothing does. */
export function alarm(state) {
  if (state.stopped) return null; // the stop button's message shows it
  const age_s = frameAge(state);
  if (state.level === "hold") return ["guard: hold - joints are held where they are", "hold", state.reasons];
  if (state.level === "torque_off") return ["guard: torque off - joints are released", "alarm", state.reasons];
  return age_s >= OLD_FRAME_S ? [`the frame is ${age_s.toFixed(1)} s old`, "hold", []] : null;
}
