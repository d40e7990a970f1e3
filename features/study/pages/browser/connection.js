// What is sent to the study and what comes from it.
//
// Every page has a number, and what a participant does names the page it was done on. What is sent
// twice, from two tabs or from a page that is not the newest, is done once: the answer is always the
// page that is shown now.

const AGAIN_MS = 3000;
const SILENT_AFTER_MS = 8000; // there is a sign of life every two seconds

let take = () => {};
let tell = () => {};
let retry = null;
let heardAt = performance.now();
let offline = false; // it was said that nothing is heard
let current = "";

// Begin to listen: ``page`` takes pages, ``state`` takes "", "saving", "not_saved", "offline",
// "not_open" or "moved_on".
export function connect(page, state) {
  take = page;
  tell = state;
  listen();
  setInterval(() => {
    if (performance.now() - heardAt > SILENT_AFTER_MS) lost();
  }, 1000);
  return refresh();
}

function lost() {
  offline = true;
  tell("offline");
}

function heard() {
  heardAt = performance.now();
  if (offline) tell("");
  offline = false;
}

function taken(page) {
  current = page.page;
  take(page);
}

async function refresh() {
  try {
    const answer = await fetch("/study/page", { cache: "no-store" });
    if (answer.status === 403) return tell("not_open");
    if (!answer.ok) throw new Error(answer.statusText);
    heard();
    const page = await answer.json();
    // Asked for twice at once it may come twice: what is filled in by then stays.
    if (page.page !== current) taken(page);
  } catch {
    lost();
    setTimeout(refresh, AGAIN_MS);
  }
}

function listen() {
  const news = new EventSource("/study/news");
  news.onmessage = (event) => {
    heard();
    if (event.data !== current && !sending) refresh();
  };
  news.onerror = () => {
    if (news.readyState !== EventSource.CLOSED) return; // it comes back by itself
    setTimeout(listen, AGAIN_MS);
    if (current && !sending) refresh();
  };
}

let sending = false;

// Send what was done on the page until it is kept, and show the page that follows, unless it is to
// ``stay`` as it is. Return whether it was this that the study took.
export async function send(what, { stay = false } = {}) {
  if (sending) return false;
  sending = true;
  const once = String(crypto.getRandomValues(new Uint32Array(2)));
  const body = JSON.stringify({ ...what, page: current, once });
  try {
    for (;;) {
      const status = await post(body, stay);
      if (status) return status === 200;
      await pause();
    }
  } finally {
    sending = false;
    retry = null;
  }
}

// Try again at once what could not be sent.
export function tryNow() {
  retry?.();
}

// Have the experimenter know that this browser cannot play the films.
export function filmFailed() {
  fetch("/study/film_failed", { method: "POST" }).catch(() => setTimeout(filmFailed, AGAIN_MS));
}

function pause() {
  return new Promise((done) => {
    retry = done;
    setTimeout(done, AGAIN_MS);
  });
}

// Return the status of an answer with a page, 0 if it has to be sent again.
async function post(body, stay) {
  tell("saving");
  let status = 0;
  let page = null;
  try {
    const answer = await fetch("/study/done", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body,
      signal: AbortSignal.timeout(15000),
    });
    status = answer.status;
    if (status === 200 || status === 409) page = await answer.json();
  } catch { /* neither kept nor refused, as far as is known here */ }
  if (!page) {
    tell(status === 403 ? "not_open" : "not_saved");
    return 0;
  }
  heard();
  tell(status === 409 ? "moved_on" : "");
  if (stay && status === 200) current = page.page;
  else taken(page);
  return status;
}
