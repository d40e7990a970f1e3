// Panel: desired, commanded and measured angles of eyes, head and lids.

import { drawLines } from "/rig/charts.js";
import { buttons, make } from "/rig/elements.js";
import { trail } from "/rig/history.js";

const SPANS = { "3 s": 3, "10 s": 10, "30 s": 30 };
const LEAST_DEG = 10, MOST_POINTS = 300;
const LINES = [["desired", "—"], ["commanded", "—"], ["measured", "—"]];

const LIDS = [
  ["upper lids, + open", "left_upper_lid", "right_upper_lid"],
  ["lower lids, + open", "left_lower_lid", "right_lower_lid"],
];
/** Charts of each choice: a title, and the joints whose mean is drawn. */
const CHARTS = {
  yaw: [
    ["eyes in the head, yaw, + left", "left_eye_pan", "right_eye_pan", "eyes_pan"],
    ["head, yaw, + left", "neck_yaw"],
    ...LIDS,
  ],
  pitch: [
    ["eyes in the head, pitch, + up", "left_eye_tilt", "right_eye_tilt", "eyes_tilt"],
    ["head, pitch, + up", "neck_pitch"],
    ...LIDS,
  ],
  neck: [
    ["neck, yaw, + left", "neck_yaw"],
    ["neck, pitch, + up", "neck_pitch"],
    ["neck, roll, + right ear down", "neck_roll"],
  ],
};

export default {
  drawer: "watch",
  title: "traces",
  open: true,
  every_ms: 160,
  build(place) {
    let shown = "yaw", last = "10 s";
    const what = buttons("show", Object.keys(CHARTS), (name) => { shown = name; });
    const span = buttons("of the last", Object.keys(SPANS), (name) => { last = name; });
    const key = make("div", { className: "key" }), charts = make("div");
    place.append(what.node, span.node, key, charts);
    return ({ state }) => {
      what.show(shown);
      span.show(last);
      draw(charts, key, state, chartsOf(shown, state.joints), SPANS[last]);
    };
  },
};

/** The charts of a choice with the rig's joints only, none empty. */
function chartsOf(choice, joints) {
  return CHARTS[choice].map(([title, ...names]) => [title, names.filter((one) => one in joints)])
    .filter(([, names]) => names.length);
}

function draw(place, key, state, charts, span_s) {
  const recent = trail.filter(({ t_s }) => t_s >= state.t_s - span_s);
  const every = Math.max(1, Math.ceil(recent.length / MOST_POINTS));
  const points = recent.filter((_, i) => (recent.length - 1 - i) % every === 0);
  const x = points.map(({ t_s }) => t_s - state.t_s);
  while (place.children.length > charts.length) place.lastChild.remove();
  let guessed = false;
  charts.forEach(([title, names], i) => {
    const figure = place.children[i] ?? place.appendChild(newChart());
    const estimated = names.some((name) => state.joints[name].estimated);
    guessed ||= estimated;
    const text = `${title}, degrees${estimated ? "; no feedback" : ""}`;
    figure.firstChild.textContent = text;
    const mean = (joints, column) => names.reduce((sum, name) => sum + joints[name][column], 0) / names.length;
    const lines = LINES.map(([name], column) => ({
      name, style: estimated && column === 2 ? "estimated" : name,
      y: points.map(({ joints }) => mean(joints, column)),
    }));
    drawLines(figure.lastChild, { title, unit: "degrees", least: LEAST_DEG, x, lines });
  });
  const shown = guessed ? [...LINES, ["estimated", "- -"]] : LINES;
  key.replaceChildren(...shown.map(([name, sign]) => make("span", {},
    make("b", { className: `line-${name}`, textContent: `${sign} ` }),
    name === "estimated" ? "estimated, not measured" : name)));
}

function newChart() {
  const canvas = make("canvas");
  canvas.setAttribute("role", "img");
  return make("figure", { className: "chart" }, make("figcaption"), canvas);
}
