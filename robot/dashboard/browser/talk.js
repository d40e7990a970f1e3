// Panel: the conversation, as a voice agent reports it, and how the head behaves in one.

import { onChoices } from "/rig/choices.js";
import { make, note } from "/rig/elements.js";
import { menu } from "/rig/steer.js";
import { duration } from "/rig/words.js";

const DOES = {
  listening: "listens", thinking: "thinks", speaking: "speaks",
  interrupted: "was interrupted, and listens",
};

export default {
  drawer: "talk",
  every_ms: 200,
  build(place) {
    const what = make("div", { className: "big" }), detail = make("div", { className: "tall" });
    const spoken = make("div", { className: "quote" }), rows = make("div");
    place.append(what, detail, spoken, rows, note("Without a voice agent, a conversation can be chosen "
      + "here: the head then looks at people as one who talks, listens or thinks."));
    let modes = null;
    onChoices(() => {
      modes = menu("conversation", "in a conversation");
      rows.replaceChildren(...(modes ? [modes.node] : []));
    });
    return ({ state, run }) => {
      const talk = state.conversation, idle = !talk || talk.state === "idle";
      what.textContent = idle ? "no conversation" : `the head ${DOES[talk.state]}`;
      detail.textContent = idle ? talk?.end_reason ?? "" : details(talk, state.t_s);
      spoken.textContent = idle || !talk.text ? "" : `“${talk.text}”`;
      modes?.refresh(run);
    };
  },
};

function details({ who, partner, since_s, ends_s }, t_s) {
  const parts = [`for ${duration(Math.max(0, t_s - since_s))}`];
  if (partner !== null && partner !== undefined) parts.unshift(`with person ${partner}`);
  if (ends_s) parts.push(`${duration(Math.max(0, ends_s - t_s))} to its planned end`);
  return `${parts.join(", ")}; reported by ${who || "a client"}`;
}
