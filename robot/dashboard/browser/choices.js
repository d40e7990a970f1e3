// What the rig offers to choose from: menus.

import { ask, on } from "/rig/connection.js";

/** menus: name -> choices. */
export const choices = { menus: {} };

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
  const menus = await ask({ do: "menus" }).catch(() => null);
  const text = JSON.stringify([menus, rig]);
  if (text === known) return; // keep a button that is being pressed
  known = text;
  choices.menus = menus ?? {};
  for (const handle of handlers) handle();
}

on("rig", read); // at the start, and when another run begins
