// Panel: play tracks; those that play have a bar, with their cues.

import { choices, onChoices } from "/rig/choices.js";
import { buttons, checkbox, heading, make, note, slider } from "/rig/elements.js";
import { order } from "/rig/orders.js";
import { spaced } from "/rig/words.js";

const NONE = "none"; // ends all tracks
const FINISHED = "finished"; // the end reason of a track at its own end

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
      const { tracks } = state;
      timeline.replaceChildren(...(tracks.length ? tracks.flatMap(rows) : [note("no track plays")]));
    };
  },
};

/** One track: its name and time, bar, joints that it owns, and cues. */
function rows(track) {
  const { name, speed, loop, position_s, duration_s, owns } = track;
  const at_s = Math.max(0, position_s);
  const bar = make("progress", { className: "track", max: Math.max(duration_s, 1e-3), value: at_s });
  bar.setAttribute("aria-label", spaced(name));
  const cues = (choices.tracks[name]?.cues ?? []).map(([cue, cue_s]) => `${cue} at ${cue_s.toFixed(1)} s`);
  return [
    heading(spaced(name) + (speed !== 1 ? `, speed ${speed}` : "") + (loop ? ", loop" : ""),
      `${at_s.toFixed(1)} of ${duration_s.toFixed(1)} s`),
    bar,
    note(owns?.length ? `owns ${owns.map(spaced).join(", ")}` : "owns no joint"),
    ...(cues.length ? [note(`cues: ${cues.join(", ")}`)] : []),
    ...remarks(track),
  ];
}

function remarks({ name, who, limited, end_reason }) {
  const texts = [];
  if (who && !end_reason) texts.push(`started by ${who}`);
  if (limited) texts.push(limited);
  if (end_reason && end_reason !== FINISHED) texts.push(`ended: ${end_reason}`);
  return texts.map((text) => note(`${spaced(name)}: ${text}`));
}
