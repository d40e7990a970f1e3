// Panel: steer the head: where it looks, how it behaves, its face and its joints.

import { choices, fitting, onChoices } from "/rig/choices.js";
import { now, on } from "/rig/connection.js";
import { buttons, note, section, slider } from "/rig/elements.js";
import { order } from "/rig/orders.js";
import { degrees, radians, spaced } from "/rig/words.js";

const AHEAD_M = [1, 0, 0.15];
const FREE = "look freely", AHEAD = "look straight ahead";
const LISTED_ELSEWHERE = ["track", "expression", "conversation"];

/** Row of buttons for a menu of the rig; null without anything to choose. */
export function menu(name, title = name) {
  const options = fitting(choices.menus[name] ?? [], now.rig).toSorted();
  if (options.length < 2) return null;
  const made = buttons(title, options, (choice) => order({ do: "ask", menu: name, choice }));
  return { ...made, refresh: (run) => made.show(run?.[name] ?? "") };
}

export default {
  drawer: "steer",
  every_ms: 100,
  build(place) {
    const behaviour = section("behaviour"), face = section("face"), joints = section("joints");
    const gaze = buttons("target", [FREE, AHEAD], (choice) => order(
      choice === FREE ? { do: "look_at", p_world_m: null }
        : { do: "look_at", p_world_m: AHEAD_M, stay: true },
    ), "release gaze and joints, or hold the gaze");
    place.append(note("Click in the camera's picture: the head looks there."), gaze.node,
      behaviour.node, face.node, joints.node);
    let menus = [];
    onChoices(() => {
      menus = Object.keys(choices.menus).filter((name) => !LISTED_ELSEWHERE.includes(name))
        .map((name) => menu(name)).filter(Boolean);
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

const STEP_DEG = 0.1;

/** Sliders of all joints at their desired angles; returns a function that moves them along. */
function jointSliders(place) {
  const sliders = new Map(), asked = new Set(); // joint -> control; joints
  on("rig", (rig) => {
    sliders.clear();
    for (const [joint, { low_rad, high_rad }] of Object.entries(rig.joints)) {
      const [low, high] = [low_rad, high_rad].map((rad) => Number(degrees(rad).toFixed(1)));
      const hint = `moves the joint, slowly; ${low} to ${high} deg, + left, up, open, right ear down`;
      const options = { name: spaced(joint), unit: "deg", low, high, step: STEP_DEG, value: 0, hint };
      sliders.set(joint, slider(options, async (deg) => {
        asked.add(joint); // until the answer the rig reports the angle before
        await order({ do: "jog", angles_rad: [[joint, radians(deg)]] });
        asked.delete(joint);
      }));
    }
    place.replaceChildren(
      note("This moves the joint of the real head slowly, within the guard's limits. All others hold "
        + `their angles until you press "${FREE}".`),
      ...[...sliders.values()].map(({ node }) => node));
  });
  return ({ joints }) => {
    for (const [joint, { show }] of sliders) {
      if (joint in joints && !asked.has(joint)) show(Number(degrees(joints[joint].desired_rad).toFixed(1)));
    }
  };
}
