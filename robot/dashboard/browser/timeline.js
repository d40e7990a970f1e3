// Panel: strip of the last half minute.

import { drawStrip } from "/rig/charts.js";
import { make } from "/rig/elements.js";
import { intervals, KEPT_S, movements } from "/rig/history.js";
import { count } from "/rig/words.js";

const TARGETS = ["face", "hand", "puppet", "idle"];
const LEVELS = {
  ok: "level-ok", limited: "level-near", hold: "hold", torque_off: "alarm", stopped: "alarm",
};
const TURNS = {
  listening: "translation", thinking: "looming", speaking: "level-ok", interrupted: "saccade",
};
const LARGE_DEG = 30; // a saccade as high as its row

export default {
  drawer: "watch",
  title: `the last ${KEPT_S} seconds`,
  open: true,
  every_ms: 320,
  build(place) {
    const canvas = make("canvas");
    canvas.setAttribute("role", "img");
    place.append(make("figure", { className: "chart" }, canvas));
    return ({ state }) => draw(canvas, state.t_s);
  },
};

function draw(canvas, t_s) {
  const bars = (name, colour, labelled = true) => intervals[name].filter(({ kind }) => kind).map(
    ({ start_s, end_s, text, kind }) => ({
      from_s: start_s - t_s, to_s: end_s - t_s, colour: colour(kind), text: labelled ? text : "",
    }),
  );
  const moved = (kind, bar) => movements.filter((one) => one.kind === kind).map((one) => ({
    from_s: one.start_s - t_s, to_s: one.end_s - t_s, ...bar(one),
  }));
  const jumps = moved("saccade", ({ start_s, size_deg }) => ({
    to_s: start_s - t_s, colour: "saccade",
    share: Math.max(0.06, Math.sqrt(Math.min(1, size_deg / LARGE_DEG))),
  }));
  const blinks = moved("blink", () => ({ colour: "calm" }));
  const turn = (kind) => TURNS[kind] ?? "calm";
  const rows = [
    { name: "target", high: 20, bars: bars("target", (kind) => (TARGETS.includes(kind) ? kind : "other")) },
    { name: "part", high: 18, bars: bars("part", (kind) => `part-${kind.replaceAll(" ", "-")}`) },
    { name: "saccades", high: 34, bars: jumps },
    { name: "blinks", high: 14, bars: blinks },
    { name: "guard", high: 14, bars: bars("guard", (kind) => LEVELS[kind] ?? "calm", false) },
    { name: "head", high: 17, bars: bars("head", turn).filter(({ text }) => text) },
    { name: "people", high: 17, bars: bars("people", () => "face") },
  ];
  const talks = intervals.head.some(({ text }) => text) || intervals.people.some(({ text }) => text);
  drawStrip(canvas, talks ? rows : rows.slice(0, -2), KEPT_S);
  const listed = (name) => [...new Set(intervals[name].map(({ text }) => text).filter(Boolean))].join(", ");
  canvas.setAttribute("aria-label",
    `the last ${KEPT_S} seconds: looked at ${listed("target") || "nothing"}; `
    + `${count(jumps.length, "saccade")}, ${count(blinks.length, "blink")}; guard ${listed("guard")}; `
    + `turns ${listed("head") || "none"}`);
}
