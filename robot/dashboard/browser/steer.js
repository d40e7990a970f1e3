// Panel: steer the head: where it looks, how it behaves, its face and its joints.

import { choices, fitting, onChoices } from "/rig/choices.js";
import { now, on } from "/rig/connection.js";
import { buttons, note, section, slider } from "/rig/elements.js";
import { order } from "/rig/orders.js";
import { degrees, radians, spaced } from "/rig/words.js";

const AHEAD_M = [1, 0, 0.15];
const FREE = "look freely", AHEAD = "look straight ahead";
const LISTED_ELSEWHERE = ["track", "expression", "conversation"];

/** Buttons that free the gaze, or hold it. */
export function gazeButtons() {
  return buttons("target", [FREE, AHEAD], (choice) => {
    held.clear();
    order(choice === FREE ? { do: "look_at", p_world_m: null }
      : { do: "look_at", p_world_m: AHEAD_M, stay: true });
  }, "release gaze and joints, or hold the gaze");
}

/** Row of buttons for a menu of the rig, or for its characters; null without anything to choose. */
export function menu(name, title = name) {
  const names = name === "character" ? choices.characters : choices.menus[name] ?? [];
  const options = fitting(names, now.rig).toSorted();
  if (options.length < 2) return null;
  const made = buttons(title, options, (choice) => order(
    name === "character" ? { do: "character", name: choice } : { do: "ask", menu: name, choice },
  ));
  return { ...made, refresh: (run) => made.show(run?.[name] ?? "") };
}

export default {
  drawer: "steer",
  every_ms: 100,
  build(place) {
    const behaviour = section("behaviour"), face = section("face"), joints = section("joints");
    place.append(note("Click in the camera's picture: the head looks there."), gazeButtons().node,
      behaviour.node, face.node, joints.node);
    let menus = [];
    onChoices(() => {
      const names = [...Object.keys(choices.menus), "character"];
      menus = names.filter((name) => !LISTED_ELSEWHERE.includes(name)).map((name) => menu(name))
        .filter(Boolean);
      behaviour.body.replaceChildren(...menus.map(({ node }) => node));
      const expressions = faces();
      face.node.hidden = !expressions.length;
      face.body.replaceChildren(...expressions);
    });
    const follow = jointSliders(joints.body);
    return ({ state, run }) => {
      for (const { refresh } of menus) refresh(run);
      follow(state);
    };
  },
};

function faces() {
  const names = choices.menus.expression ?? [];
  if (!names.length) return [];
  const sorted = names.toSorted((a, b) => (b === "neutral") - (a === "neutral") || a.localeCompare(b));
  let strength = 1;
  const row = buttons("expression", sorted, (expression) => order({ do: "express", expression, strength }));
  const share = slider({ name: "strength", low: 0, high: 1, step: 0.05, value: 1 },
    (value) => { strength = value; });
  return [row.node, share.node];
}

// --- joints -------------------------------------------------------------------------------------

const STEP_DEG = 0.1, FOLLOWS_DEG = 0.15, SAME_DEG = 0.3;
const FREE_AFTER_S = 0.5; // with another desired angle a joint no longer counts as held
const held = new Map(); // joint -> {asked_deg, at_s: when it was last desired}

/** Sliders of all joints; returns a function that lets them follow the joints that nobody holds. */
function jointSliders(place) {
  const sliders = new Map(); // joint -> {control, low, high, value}
  const estimates = note("");
  on("rig", (rig) => {
    sliders.clear();
    for (const [joint, { low_rad, high_rad }] of Object.entries(rig.joints)) {
      const [low, high] = [low_rad, high_rad].map((rad) => Number(degrees(rad).toFixed(1)));
      const value = Math.min(Math.max(0, low), high);
      const hint = `moves the joint, slowly; ${low} to ${high} deg, + left, up, open, right ear down`;
      const options = { name: spaced(joint), unit: "deg", low, high, step: STEP_DEG, value, hint };
      sliders.set(joint, { control: slider(options, (deg) => jog(joint, deg)), low, high, value });
    }
    place.replaceChildren(
      note("This moves the joint of the real head slowly, within the guard's limits. All others hold "
        + `their angles until you press "${FREE}".`),
      ...[...sliders.values()].map(({ control }) => control.node), estimates);
  });
  return (state) => {
    const guessed = [];
    for (const [joint, one] of sliders) {
      const reading = state.joints[joint];
      if (!reading) continue;
      if (reading.estimated) guessed.push(spaced(joint));
      const angle = degrees(reading.measured_rad);
      if (isHeld(joint, reading, state) || Math.abs(angle - one.value) < FOLLOWS_DEG) continue;
      one.value = Number(Math.min(Math.max(angle, one.low), one.high).toFixed(1));
      one.control.show(one.value);
    }
    const who = guessed.length === sliders.size ? "all joints" : guessed.join(", ");
    estimates.textContent = guessed.length
      ? `${who}: estimated from the goals, not measured: the servos give no feedback` : "";
  };
}

function jog(joint, deg) {
  held.set(joint, { asked_deg: deg, at_s: now.state?.t_s ?? 0 });
  return order({ do: "jog", angles_rad: [[joint, radians(deg)]] });
}

/** Whether a person's angle of a joint is still desired; a stop or another order releases it. */
function isHeld(joint, reading, state) {
  const one = held.get(joint);
  if (!one) return false;
  const same = Math.abs(degrees(reading.desired_rad) - one.asked_deg) < SAME_DEG;
  if (same && !state.stopped) one.at_s = state.t_s;
  else if (state.stopped || state.t_s - one.at_s > FREE_AFTER_S || state.t_s < one.at_s) held.delete(joint);
  return held.has(joint);
}
