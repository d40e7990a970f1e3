// The participant's page: one sheet, which shows what the study says and sends what is done.

import { connect, filmFailed, send, tryNow } from "./connection.js";
import { button, make, paragraphs, readTexts, say } from "./elements.js";
import { presentation, ready } from "./presentation.js";
import { questions } from "./questions.js";

const sheet = document.getElementById("sheet");
const notice = document.getElementById("notice");
const where = document.getElementById("where");
const along = document.getElementById("along");
const stop = document.getElementById("stop");
const leave = document.getElementById("leave");

const MOVED_ON_MS = 6000;
const DAYS_OF_YEAR = 365;

const SHEETS = {
  consent, instructions, ready, presentation, questions, rest, paused, end,
};
const WITHOUT_LEAVING = new Set(["consent", "end"]);

let timer = null; // of a rest

// --- what is shown --------------------------------------------------------------------------------

function show(page) {
  clearInterval(timer);
  if (leave.open && WITHOUT_LEAVING.has(page.kind)) leave.close();
  stop.hidden = WITHOUT_LEAVING.has(page.kind);
  sheet.className = page.kind;
  sheet.replaceChildren(SHEETS[page.kind](page, send));
  progress(page);
  const title = sheet.querySelector("h1");
  document.title = title ? `${title.textContent} – ${say("title")}` : say("title");
  scrollTo(0, 0);
  (title ?? sheet).focus({ preventScroll: true });
}

function progress({ step }) {
  along.hidden = !step;
  where.textContent = "";
  if (!step) return;
  const words = say("trial", { n: step.n, of: step.of });
  where.textContent = step.practice ? `${say("practice")} · ${words}` : words;
  along.setAttribute("aria-valuemax", step.of);
  along.setAttribute("aria-valuenow", step.n - 1);
  along.setAttribute("aria-label", where.textContent);
  along.firstElementChild.style.width = step.practice ? "0" : `${100 * (step.n - 1) / step.of}%`;
}

// Films are WebM; who could not see them is told before anything is asked.
const seesFilms = () => document.createElement("video").canPlayType("video/webm") !== "";

function consent(page) {
  if (!page.camera && !seesFilms()) {
    filmFailed();
    return make("section", {}, make("h1", { tabIndex: -1 }, say("consent.title")),
      make("p", { role: "alert" }, say("film.failed")));
  }
  const tick = (key, required) => {
    const box = make("input", { type: "checkbox", id: `use-${key}`, required });
    return { box, element: make("p", { className: "tick" }, box, make("label", { htmlFor: box.id }, say(`consent.${key}`))) };
  };
  const agree = tick("agree", true);
  const uses = page.uses.map((use) => [use, tick(use, false)]);
  const missing = make("p", { className: "wrong", role: "alert" });
  const years = page.days % DAYS_OF_YEAR === 0 && page.days > DAYS_OF_YEAR;
  const kept = [
    say("consent.answers", { code: page.code }),
    ...(page.camera && !page.uses.includes("pictures") ? [say("consent.camera")] : []),
    say(years ? "consent.years" : "consent.days", { count: years ? page.days / DAYS_OF_YEAR : page.days }),
    page.contact ? say("consent.contact", { contact: page.contact }) : say("consent.no_contact"),
  ];
  const form = make(
    "form", { noValidate: true },
    make("h1", { tabIndex: -1 }, say("consent.title")),
    ...paragraphs([...page.welcome, say("consent.voluntary")]),
    make("h2", {}, say("consent.kept")),
    make("ul", {}, ...kept.map((line) => make("li", {}, line))),
    make("fieldset", {}, make("legend", {}, say("consent.uses")),
      agree.element, ...uses.map(([, { element }]) => element)),
    missing,
    make("div", { className: "row" },
      make("button", { type: "submit", className: "main" }, say("consent.accept")),
      button("consent.decline", () => send({ do: "consent", given: false, uses: [] }), "")),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    missing.textContent = agree.box.checked ? "" : say("consent.missing");
    if (!agree.box.checked) return agree.box.focus();
    const given = uses.filter(([, { box }]) => box.checked).map(([use]) => use);
    send({ do: "consent", given: true, uses: given });
  });
  return form;
}

function instructions(page) {
  const kind = `instructions.${page.on}${page.pairs ? "_pairs" : ""}`;
  const some = page.practice === 1 ? "instructions.practice" : "instructions.practices";
  return make(
    "section", {},
    make("h1", { tabIndex: -1 }, say("instructions.title")),
    ...paragraphs([
      say(kind, { count: page.count + page.practice, seconds: Math.round(page.seconds) }),
      ...(page.practice ? [say(some, { count: page.practice })] : []),
      say("instructions.impression"),
    ]),
    make("p", { className: "note keys" }, say("instructions.keys")),
    button("next", () => send({ do: "next" })),
  );
}

function rest(page) {
  const words = make("p", { role: "timer" });
  const on = button("next", () => send({ do: "next" }));
  const since = performance.now();
  const count = () => {
    const left = Math.ceil(page.seconds - (performance.now() - since) / 1000);
    words.textContent = left > 0 ? say("rest.wait", { seconds: left }) : say("rest.ready");
    on.disabled = left > 0;
  };
  timer = setInterval(count, 250);
  count();
  return make(
    "section", { className: "calm" }, make("h1", { tabIndex: -1 }, say("rest.title")),
    make("div", { className: "breath", "aria-hidden": "true" }),
    make("p", {}, say("rest.breathe")), words, on,
  );
}

function paused() {
  return make(
    "section", { className: "calm" }, make("h1", { tabIndex: -1 }, say("paused.title")),
    make("p", {}, say("paused.text")),
  );
}

function end(page) {
  const code = page.code ? [
    make("p", {}, `${say("end.code")} `, make("strong", { className: "code" }, page.code)),
    ...paragraphs([
      say("end.note"),
      page.contact ? say("consent.contact", { contact: page.contact }) : say("consent.no_contact"),
    ]),
  ] : [];
  return make(
    "section", {},
    make("h1", { tabIndex: -1 }, say(page.outcome === "finished" ? "end.title" : "end.over")),
    ...paragraphs([...page.text, say(`end.${page.outcome}`)]), ...code,
  );
}

// --- what goes wrong, and leaving -------------------------------------------------------------------

let soon = null;
let said = "";

function state(now) {
  if (now === said) return; // what stands there is not read out again
  said = now;
  clearTimeout(soon);
  document.body.classList.toggle("sending", now === "saving");
  if (now === "saving") { // said only where it takes long enough to be noticed
    soon = setTimeout(() => notice.replaceChildren(say("saving")), 600);
    return;
  }
  notice.className = now;
  notice.replaceChildren(...(now ? [make("span", {}, say(now))] : []));
  if (now === "not_saved") notice.append(button("not_saved.again", tryNow, "quiet"));
  if (now === "moved_on") soon = setTimeout(() => notice.replaceChildren(), MOVED_ON_MS);
}

function ask() {
  if (!stop.hidden && !leave.open) leave.showModal();
}

function furnish() {
  const words = {
    stop: "withdraw.button", "leave-title": "withdraw.title", "leave-text": "withdraw.text",
    "leave-no": "withdraw.no", "leave-yes": "withdraw.yes",
  };
  for (const [id, key] of Object.entries(words)) document.getElementById(id).textContent = say(key);
  stop.addEventListener("click", ask);
  document.addEventListener("keydown", (event) => {
    if (leave.open) return;
    if (event.key === "Escape") {
      event.preventDefault();
      ask();
    }
    // Enter goes on also before the keyboard has come to the button.
    const nowhere = [document.body, sheet].includes(event.target) || event.target.tagName === "H1";
    if (event.key === "Enter" && nowhere && !event.repeat) sheet.querySelector("button.main")?.click();
  });
  document.getElementById("leave-no").addEventListener("click", () => leave.close());
  document.getElementById("leave-yes").addEventListener("click", () => {
    leave.close();
    send({ do: "withdraw" });
  });
}

await readTexts();
furnish();
connect(show, state);
