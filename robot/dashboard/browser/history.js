// The last half minute: targets, levels of the guard, eye movements.

import { now, on } from "/rig/connection.js";
import { degrees, isLed } from "/rig/words.js";

export const KEPT_S = 30;

/** Intervals {start_s, end_s, text, kind} in which a value was constant, oldest first. */
export const intervals = { target: [], part: [], guard: [], head: [], people: [] };
/** Saccades and blinks that have ended: {kind, start_s, end_s, size_deg}. */
export const movements = [];
let newest_s = -Infinity;
const begun = {}; // kind -> {t_s, direction_rad} at the start of the present one

/** Lengthen a row's last interval, or begin the next one. */
function extend(row, t_s, text, kind) {
  const last = row.at(-1);
  if (last?.text === text && last.kind === kind) last.end_s = t_s;
  else row.push({ start_s: last?.end_s ?? t_s, end_s: t_s, text, kind });
}

/** Since when the target at a time has been looked at. */
export function targetSince(t_s) {
  return intervals.target.findLast(({ start_s }) => start_s <= t_s)?.start_s ?? t_s;
}

function forget(before_s) {
  while (movements[0]?.end_s < before_s) movements.shift();
  for (const row of Object.values(intervals)) while (row[0]?.end_s < before_s) row.shift();
}

on("state", (state) => {
  const { t_s, gaze } = state;
  if (t_s < newest_s) forget(Infinity); // the rig was started again
  newest_s = t_s;
  const led = isLed(state);
  const part = led ? "" : gaze.part ?? "";
  const turn = state.conversation?.state ?? "idle";
  const speaking = state.people.filter((person) => person.speaks).map(({ id }) => id).join(", ");
  extend(intervals.target, t_s, gaze.target.split(":")[0], led ? state.control_source.kind : gaze.kind);
  extend(intervals.part, t_s, part, part);
  const level = state.stopped ? "stopped" : state.level;
  extend(intervals.guard, t_s, level.replace("_", " "), level);
  extend(intervals.head, t_s, turn === "idle" ? "" : turn, turn);
  extend(intervals.people, t_s, speaking && `speaks: ${speaking}`, speaking && "face");
  forget(t_s - KEPT_S);
});

/** Store a movement of the eyes when it ends. */
function end(kind, t_s, direction_rad) {
  if (!begun[kind]?.direction_rad) return;
  const size_deg = degrees(angleBetween(begun[kind].direction_rad, direction_rad));
  movements.push({ kind, start_s: begun[kind].t_s, end_s: t_s, size_deg });
  begun[kind] = null;
}

/** Angle between two directions given by yaw and pitch. */
function angleBetween([yaw, pitch], [otherYaw, otherPitch]) {
  const same = Math.cos(pitch) * Math.cos(otherPitch) * Math.cos(yaw - otherYaw)
    + Math.sin(pitch) * Math.sin(otherPitch);
  return Math.acos(Math.min(1, same));
}

on("state", ({ t_s, gaze: { blink, direction_rad } }) => {
  if (!blink) end("blink", t_s, direction_rad);
  else begun.blink ??= { t_s, direction_rad };
});

on("event", ({ kind, t_s }) => {
  const direction_rad = now.state?.gaze.direction_rad;
  if (kind === "saccade_start") begun.saccade = { t_s, direction_rad };
  if (kind === "saccade_landing") end("saccade", t_s, direction_rad);
});
