// What is judged: a film in the page, or the head in the room.

import { filmFailed } from "./connection.js";
import { button, make, say } from "./elements.js";

// Return what stands before a presentation.
export function ready(page, send) {
  return before(page, () => beginning(send));
}

let begun = false; // it is this tab that begins the presentation which comes

async function beginning(send) {
  begun = true;
  await send({ do: "begin" }); // shows what follows
  begun = false;
}

// Return a presentation. A film that was begun before the page was reloaded, or by another tab,
// begins again when the participant says so.
export function presentation(page, send) {
  if (!page.film) return inTheRoom();
  if (begun) return filmed(page, send);
  return before(page, async () => {
    if (await send({ do: "seen", seconds: 0 }, { stay: true })) await beginning(send);
  });
}

function before(page, begin) {
  const title = page.side === null ? "ready.title" : page.side === 0 ? "ready.first" : "ready.second";
  const again = page.again ? [make("p", { className: "again" }, say("ready.again"))] : [];
  return make(
    "section", { className: "calm" }, make("h1", { tabIndex: -1 }, say(title)), ...again,
    make("p", {}, say(`ready.${page.on}`, { seconds: Math.round(page.seconds) })),
    button("ready.button", begin),
  );
}

function inTheRoom() {
  return make(
    "section", { className: "calm look" },
    make("h1", { tabIndex: -1 }, say("head.look")), make("p", { className: "note" }, say("head.on")),
  );
}

// --- a film -------------------------------------------------------------------------------------

// The whole film is there before it starts, so that it does not stop in between.
async function load(address) {
  const answer = await fetch(address, { cache: "no-store" });
  if (!answer.ok) throw new Error(String(answer.status));
  const video = make("video", {
    muted: true, playsInline: true, preload: "auto", disablePictureInPicture: true,
    disableRemotePlayback: true, "aria-label": say("film.label"),
    src: URL.createObjectURL(await answer.blob()),
  });
  video.addEventListener("contextmenu", (event) => event.preventDefault());
  return video;
}

function filmed(page, send) {
  const words = make("p", { className: "note", role: "status" }, say("film.loading"));
  const sheet = make("div", { className: "film" }, make("h1", { tabIndex: -1, className: "read-out" }, say("film.label")), words);
  const attempt = (ms) => load(page.film).then(play, () => {
    words.textContent = say("offline");
    setTimeout(() => sheet.isConnected && attempt(2 * ms), ms);
  });
  attempt(1000);

  function play(video) {
    // How much of it was seen is the study's to judge; what is too little is shown again.
    const over = (seconds) => {
      document.removeEventListener("visibilitychange", hidden);
      URL.revokeObjectURL(video.src);
      if (seconds !== undefined) send({ do: "seen", seconds });
    };
    const hidden = () => {
      if (!sheet.isConnected) over();
      else if (document.hidden) over(video.currentTime);
    };
    video.addEventListener("ended", () => over(video.currentTime), { once: true });
    video.addEventListener("error", () => {
      over();
      filmFailed();
      sheet.replaceChildren(words);
      words.textContent = say("film.failed");
    }, { once: true });
    document.addEventListener("visibilitychange", hidden);
    sheet.append(video);
    words.textContent = "";
    if (document.hidden) return hidden();
    video.play().catch((error) => {
      if (error.name === "NotAllowedError") over(0);
    });
  }
  return sheet;
}
