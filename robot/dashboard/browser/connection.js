// Connection to the rig: the websocket of every program, /api/v1/socket, as in docs/connect-your-program.md.
//
// One connection per tab. It reconnects by itself; the newest state is in `now`, and modules
// subscribe to the kinds of messages that they need.

const AGAIN_MS = 500;
const LOST_AFTER_MS = 3000; // the server sends at least once a second
const ANSWER_MS = 10_000;
const QUERY = "rate_hz=25&pictures=true&rig=true";

/**
 * Newest messages: state, rig, run; shown: the state at the capture of the picture that is shown;
 * you: this browser's name; silent: whether the rig is.
 */
export const now = { state: null, shown: null, rig: null, run: null, you: "", silent: false };

const handlers = new Map(); // kind -> functions
const waiting = new Map(); // tag -> {resolve, reject, timer}
let socket = null, tag = 0, heardAt = performance.now(), heard = false, picture = null;

/**
 * Call a function with each message of a kind: state, rig, run, picture, panel, silent, closed.
 * Of state, rig and run also with the newest one before, as scripts are loaded in any order.
 */
export function on(kind, handle) {
  if (!handlers.has(kind)) handlers.set(kind, []);
  handlers.get(kind).push(handle);
  if (now[kind]) queueMicrotask(() => handle(now[kind]));
}

/** Call the functions of a kind; an error in one does not keep the others from the message. */
function emit(kind, ...values) {
  for (const handle of handlers.get(kind) ?? []) {
    try { handle(...values); } catch (error) { console.error(error); }
  }
}

/** Whether the server can be reached. */
export const isLost = () => performance.now() - heardAt > LOST_AFTER_MS;
/** Whether the rig sends its state. */
export const isSilent = () => isLost() || now.silent;

export const isOpen = () => socket?.readyState === WebSocket.OPEN;

/** Send a message without waiting for its answer; return whether a connection is open. */
export function tell(message) {
  if (!isOpen()) return false;
  socket.send(JSON.stringify(message));
  return true;
}

/** Send a message and return its result; a refusal is an Error with its reason. */
export function ask(message) {
  return new Promise((resolve, reject) => {
    const mine = ++tag;
    if (!tell({ ...message, tag: mine })) return reject(new Error("there is no connection"));
    const timer = setTimeout(() => settle(mine, { failed: "no answer" }), ANSWER_MS);
    waiting.set(mine, { resolve, reject, timer });
  });
}

function settle(mine, { ok, refused, failed }) {
  const one = waiting.get(mine);
  if (!one) return;
  waiting.delete(mine);
  clearTimeout(one.timer);
  const why = refused ?? failed;
  if (why === undefined) one.resolve(ok);
  else one.reject(new Error(why));
}

function receive(message) {
  if (message.state) {
    now.state = message.state;
    now.silent = false;
    emit("state", message.state);
  } else if (message.rig || message.run) {
    Object.assign(now, message);
    emit(message.rig ? "rig" : "run", message.rig ?? message.run);
  } else if (message.picture) picture = message.picture; // its image follows
  else if (message.panel) emit("panel", message.panel);
  else if (message.silent !== undefined) {
    now.silent = true;
    emit("silent", message.silent);
  } else if (message.tag === "hello") now.you = message.ok?.you ?? "";
  else if (message.tag !== undefined) settle(message.tag, message);
}

/** Open a websocket at a path of the rig. */
export const openSocket = (path) => new WebSocket(location.origin.replace(/^http/, "ws") + path);

function connect() {
  const mine = openSocket(`/api/v1/socket?${QUERY}`);
  mine.binaryType = "blob";
  socket = mine;
  mine.onmessage = ({ data }) => {
    heardAt = performance.now();
    heard = true;
    if (typeof data === "string") return receive(JSON.parse(data));
    if (picture) emit("picture", picture, data);
    picture = null;
  };
  mine.onclose = () => {
    for (const one of [...waiting.keys()]) settle(one, { failed: "the connection was lost" });
    emit("closed", heard);
    heard = false;
    setTimeout(connect, AGAIN_MS);
  };
}

connect();
