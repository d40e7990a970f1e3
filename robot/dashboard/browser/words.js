// The state of the head in plain words.

export const degrees = (rad) => (rad * 180) / Math.PI;
export const radians = (deg) => (deg * Math.PI) / 180;

/** A name of the rig as text: neck_yaw is "neck yaw". */
export const spaced = (name) => name.replaceAll("_", " ");

/** A number of things: "1 joint", "2 joints". */
export const count = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;

/** A duration: "1.2 s", "34 s", "3 min". */
export function duration(s) {
  return s < 10 ? `${s.toFixed(1)} s` : s < 120 ? `${s.toFixed(0)} s` : `${(s / 60).toFixed(0)} min`;
}

/** Whether a client, a stop or the end of the run leads, and not the head's own choice. */
export const isLed = (state) => !["gaze", "track"].includes(state.control_source.kind);

/** Number of the person at whom the head looks, NaN if it looks at something else. */
export const personOf = ({ target }) => Number(/^face (\d+)/.exec(target)?.[1]);

/** What the head does, with all that is known about its target; since_s: when it chose this. */
export function activity(state, since_s) {
  const { gaze, people } = state;
  if (isLed(state) || state.control_source.kind === "track") return state.headline;
  const lasting = `, for ${duration(Math.max(0, state.t_s - since_s))}`;
  const person = people.find(({ id }) => id === personOf(gaze));
  if (!person) return state.headline + lasting;
  const who = person.speaks ? ", who speaks" : person.looks_at_head ? ", who looks back" : "";
  return `looks at person ${person.id}${who}${lasting}`;
}

const BECAUSE = {
  translation: "moves",
  looming: "comes nearer or goes away",
  rotation: "turns",
  onset: "has just come into view",
};
export const TERMS = [...Object.keys(BECAUSE), "rule"];
const LEAST = 0.005, SHARE = 0.1; // of a term that is mentioned, absolute and of the largest

/** Why the head looks there, with its strongest reasons: "it moves, and the behaviour wait prefers it". */
export function reason(state, run, count = 3) {
  const [first] = state.saliences;
  if (isLed(state) || first?.kind !== state.gaze.kind) return state.gaze.reason;
  const most = Math.max(...Object.keys(BECAUSE).map((term) => first[term]));
  const moves = Object.entries(BECAUSE)
    .filter(([term]) => first[term] >= Math.max(LEAST, SHARE * most))
    .toSorted(([a], [b]) => first[b] - first[a])
    .slice(0, count)
    .map(([, words]) => words);
  const [action, because] = (state.plan ?? "").split(": ");
  const behaviour = `the behaviour ${spaced(action || run?.behaviour || "")}`.trim();
  const planned = because ? `: ${because}` : "";
  const it = listed(moves);
  if (first.rule < LEAST) return it ? `it ${it}` : state.gaze.reason;
  return it ? `it ${it}, and ${behaviour} prefers it${planned}` : `${behaviour} asks for it${planned}`;
}

function listed(parts) {
  return parts.length < 2 ? parts.join("") : `${parts.slice(0, -1).join(", ")} and ${parts.at(-1)}`;
}

/** What limits have changed of an order, "" if nothing; reply: a CommandReply. */
export function limits(reply) {
  const { name, limited } = reply.track ?? {};
  return limited ? `${spaced(name)}: ${spaced(limited)}` : "";
}
