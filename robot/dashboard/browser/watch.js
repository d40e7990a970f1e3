// Panel: what the head looks at and why, in plain words; the terms of the equation in a fold.

import { onShown } from "/rig/camera.js";
import { chip, heading, make, note, pill, section } from "/rig/elements.js";
import { activity, isLed, reason, spaced, TERMS } from "/rig/words.js";

const PHASES = { fixate: "ok", saccade: "saccade", pursue: "pursue", blink: "calm" };
const LEAST_FULL = 1; // salience of a bar as wide as the panel, or the highest one
const SOURCES = "translation, looming and rotation are motion across, along and about the line of "
  + "sight (Mitake et al., eq 1); onset is having just come into view, rule the behaviour's "
  + "constant, habituation the share that it leaves";

let target = "", since_s = 0; // of the target that is shown

onShown(({ t_s, gaze }) => {
  const next = gaze.target.split(":")[0]; // without the part
  if (next === target && t_s >= since_s) return;
  [target, since_s] = [next, t_s];
});

export default {
  drawer: "watch",
  every_ms: 200,
  build(place) {
    const what = make("div", { className: "big", textContent: "waiting for the rig" });
    const why = make("div", { className: "tall" });
    const chips = make("div", { className: "in-force" });
    const terms = section("why: the terms of the equation", false);
    const estimated = note("The eyes' servos give no feedback: these are the movements that the eyes "
      + "should make, estimated from their goals, and no measurements.");
    place.append(what, why, chips, terms.node, estimated);
    return ({ shown, state, run }) => {
      what.textContent = activity(shown, since_s);
      why.textContent = isLed(shown) ? "" : sentence(reason(shown, run));
      chips.replaceChildren(...present(shown, run));
      const joints = Object.entries(state.joints);
      estimated.hidden = !joints.some(([name, joint]) => joint.estimated && name.includes("eye"));
      if (terms.node.open) terms.body.replaceChildren(...bars(shown));
    };
  },
};

const sentence = (text) => text && `${text[0].toUpperCase()}${text.slice(1)}.`;

/** Phase of the eyes, and the choices that are in force. */
function present(state, run) {
  const { gaze, conversation: talk } = state;
  const phase = gaze.blink ? "blink" : gaze.phase;
  const turn = talk && talk.state !== "idle" ? talk.state : run?.conversation;
  const choices = {
    behaviour: run?.behaviour, plan: state.plan?.split(":")[0], character: run?.character,
    conversation: turn,
  };
  const named = Object.entries(choices).filter(([, name]) => name && name !== "none");
  return [pill(phase, PHASES[phase] ?? "calm"),
    ...named.map(([kind, name]) => chip(`${kind}: ${spaced(name)}`))];
}

/** Saliences of the bodies by term, the highest first. */
function bars({ saliences, control_source }) {
  if (!saliences.length) {
    const why = control_source.kind === "gaze" ? "nothing is salient: the gaze wanders"
      : "a client leads: no salience counts";
    return [note(why)];
  }
  const sum = (one) => TERMS.reduce((total, term) => total + Math.max(0, one[term]), 0);
  const full = Math.max(LEAST_FULL, saliences[0].total, ...saliences.map(sum));
  const rows = saliences.map((one, i) => body(one, full, i === 0));
  const key = TERMS.map((term) => make("span", {},
    make("span", { className: `swatch term-${term}` }), term));
  return [
    heading("salience", "habituation  total"),
    make("div", { className: "rows" }, ...rows),
    make("div", { className: "key" }, ...key),
    note(SOURCES),
  ];
}

function body(one, full, first) {
  const parts = TERMS.map((term) => {
    const bar = make("div", { className: `term-${term}` });
    bar.style.width = `${((100 * Math.max(0, one[term])) / full).toFixed(1)}%`;
    return bar;
  });
  const values = TERMS.filter((term) => Math.abs(one[term]) >= 0.005)
    .map((term) => `${term} ${one[term].toFixed(2)}`);
  const bar = make("div", { className: "bar" }, ...parts);
  bar.setAttribute("aria-hidden", "true");
  return make("div", { className: first ? "body first" : "body" },
    make("div", {}, make("span", { textContent: `${one.kind} ${one.id}` }),
      make("span", { textContent: `${one.habituation.toFixed(2)} × ${one.total.toFixed(2)}` })),
    bar,
    make("div", { className: "small", textContent: values.join(" ") }));
}
