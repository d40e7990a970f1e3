// Orders of a person to the rig, and messages that disappear after some seconds.

import { ask, on } from "/rig/connection.js";
import { make } from "/rig/elements.js";
import { limits } from "/rig/words.js";

const NOTICE_MS = 8000, REFUSED_MS = 14_000;

/** Show a message for some seconds; a refusal is read out immediately. */
export function say(text, refused = false) {
  const notices = document.querySelector("#notices");
  const shut = make("button", { type: "button", textContent: "×" });
  shut.setAttribute("aria-label", "close this message");
  const node = make("div", { className: refused ? "notice refused" : "notice" },
    make("span", { textContent: text }), shut);
  node.setAttribute("role", refused ? "alert" : "status");
  shut.addEventListener("click", () => node.remove());
  notices.append(node);
  setTimeout(() => node.remove(), refused ? REFUSED_MS : NOTICE_MS);
}

/** Send an order; show what the rig refuses or limits. Return the result, null if refused. */
export async function order(message) {
  try {
    const result = await ask(message);
    if (result?.reply?.refused) throw new Error(result.reply.refused);
    const limited = result?.reply ? limits(result.reply) : "";
    if (limited) say(limited);
    return result ?? {};
  } catch (error) {
    say(error.message, true);
    return null;
  }
}

let chosen = "";
on("rig", ({ choice }) => { // settings chosen for this computer
  if (choice && choice !== chosen) say(choice);
  chosen = choice;
});
