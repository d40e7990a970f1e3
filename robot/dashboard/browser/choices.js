// What the rig offers to choose from: menus and tracks.

import { ask, on } from "/rig/connection.js";

/** menus: name -> choices; tracks: name -> what is known of it. */
export const choices = { menus: {}, tracks: {} };

const BOXING = /boxer|^attack$|^guard$/;

/** Only a head in a boxing world boxes. */
export function fitting(names, rig) {
  return rig?.opponent ? names : names.filter((name) => !BOXING.test(name));
}

const handlers = [];
/** Call a function when the choices have arrived or changed. */
export function onChoices(handle) {
  handlers.push(handle);
}

let known = "";

async function read(rig) {
  const answers = await Promise.all(
    ["menus", "tracks"].map((verb) => ask({ do: verb }).catch(() => null)),
  );
  const text = JSON.stringify([answers, rig]);
  if (text === known) return; // keep a button that is being pressed
  known = text;
  const [menus, tracks] = answers;
  choices.menus = menus ?? {};
  choices.tracks = Object.fromEntries((tracks ?? []).map((track) => [track.name, track]));
  for (const handle of handlers) handle();
}

on("rig", read); // at the start, and when another run begins
