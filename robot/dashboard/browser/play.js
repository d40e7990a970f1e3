// Panel: play tracks; those that play are on a timeline, with sound and cues.

import { prepare } from "/rig/charts.js";
import { choices, onChoices } from "/rig/choices.js";
import { buttons, checkbox, make, note, slider } from "/rig/elements.js";
import { order } from "/rig/orders.js";
import { spaced } from "/rig/words.js";

const NONE = "none"; // ends all tracks
const FINISHED = "finished"; // the end reason of a track at its own end
const WAVE = 22, BAR = 7, TOP = 20, HIGH = TOP + WAVE + BAR + 22;

export default {
  drawer: "play",
  every_ms: 200,
  build(place) {
    let speed = 1, row = null;
    const pace = slider({ name: "speed", unit: "×", low: 0.25, high: 4, step: 0.05, value: 1 },
      (value) => { speed = value; });
    const loop = checkbox({ name: "loop", hint: "repeat until it is ended" });
    const timeline = make("div"), top = make("div");
    place.append(top, pace.node, loop.node, timeline);
    onChoices(() => {
      const names = (choices.menus.track ?? []).filter((name) => name !== NONE).toSorted();
      row = buttons("play", [NONE, ...names], (name) => order(name === NONE
        ? { do: "end_track", track: "" } : { do: "play", track: name, speed, loop: loop.value }));
      top.replaceChildren(row.node);
    });
    return ({ state }) => {
      const playing = state.tracks.filter((track) => !track.end_reason);
      row?.show(playing.at(-1)?.name ?? NONE);
      draw(timeline, state.tracks);
    };
  },
};

function draw(place, tracks) {
  if (!tracks.length) return place.replaceChildren(note("no track plays"));
  const [canvas, ...notes] = tracks.flatMap((track, i) => {
    const drawn = place.querySelectorAll("canvas")[i] ?? make("canvas", { className: "track" });
    return [drawn, ...remarks(track)];
  });
  place.replaceChildren(canvas, ...notes);
  tracks.forEach((track, i) => drawTrack(place.querySelectorAll("canvas")[i], track));
}

function remarks({ name, who, limited, end_reason }) {
  const texts = [];
  if (who && !end_reason) texts.push(`started by ${who}`);
  if (limited) texts.push(limited);
  if (end_reason && end_reason !== FINISHED) texts.push(`ended: ${end_reason}`);
  return texts.map((text) => note(`${spaced(name)}: ${text}`));
}

const waves = new Map(); // track -> outline of its sound, null while it is not known

function wave(name) {
  if (!waves.has(name)) {
    waves.set(name, null);
    fetch(`/api/v1/waveform?track=${encodeURIComponent(name)}`)
      .then((answer) => answer.json())
      .then(({ ok }) => waves.set(name, ok ?? null))
      .catch(() => {});
  }
  return waves.get(name);
}

/** One track: its name and time, sound, bar with cues, and joints that it owns. */
function drawTrack(canvas, track) {
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${spaced(track.name)} at ${track.position_s.toFixed(1)} s`);
  const ready = prepare(canvas, HIGH);
  if (!ready) return;
  const { pen, width, colour } = ready, ink = pen.fillStyle;
  const lasts_s = Math.max(track.length_s, 1e-3);
  const across = (s) => Math.min(Math.max(s / lasts_s, 0), 1) * (width - 2);
  pen.fillText(spaced(track.name) + (track.speed !== 1 ? `, speed ${track.speed}` : "")
    + (track.rounds === 0 ? ", loop" : ""), 0, 13);
  pen.textAlign = "right";
  pen.fillText(`${Math.max(0, track.position_s).toFixed(1)} of ${track.length_s.toFixed(1)} s`, width, 13);
  pen.textAlign = "left";
  const outline = track.sound ? wave(track.name) : null;
  pen.fillStyle = colour("calm");
  outline?.forEach((share, i) => {
    const tall = Math.max(0.6, share * WAVE), step = width / outline.length;
    pen.fillRect(i * step, TOP + (WAVE - tall) / 2, 0.8 * step, tall);
  });
  const bar = TOP + WAVE, x = across(track.position_s);
  pen.fillStyle = colour("line-grid");
  pen.fillRect(0, bar, width, BAR);
  pen.fillStyle = colour("level-ok");
  pen.fillRect(0, bar, x, BAR);
  pen.fillStyle = ink;
  for (const [name, at_s] of track.cues) {
    pen.fillRect(across(at_s), bar - 4, 1, BAR + 4);
    pen.fillText(name, Math.min(across(at_s) + 3, width - pen.measureText(name).width), bar - 4);
  }
  pen.fillStyle = colour("text");
  pen.fillRect(x, TOP - 2, 2, WAVE + BAR + 2);
  const owns = track.owns?.length ? `owns ${track.owns.map(spaced).join(", ")}` : "owns no joint";
  pen.fillStyle = ink;
  pen.fillText(owns, 0, HIGH - 6, width);
}
