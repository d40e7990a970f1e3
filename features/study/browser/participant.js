// The participant's page: it shows the present page of the session, and sends what is done.

const byId = (id) => document.getElementById(id);
const sheet = byId("sheet"), stop = byId("stop"), leave = byId("leave");
const AGAIN_MS = 1000;
let current = null; // the page that is shown
let sending = false;

// Return a new element: make("p", {className: "note"}, "text", another element, ...).
function make(tag, properties, ...inside) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...inside);
  return element;
}

const paragraphs = (...lines) => lines.filter(Boolean).map((line) => make("p", {}, line));
const title = (text) => make("h1", { tabIndex: -1 }, text);
function button(text, action) {
  const element = make("button", { type: "button", className: "main" }, text);
  element.addEventListener("click", action);
  return element;
}

// --- the connection ---------------------------------------------------------------------------------

const pause = () => new Promise((done) => setTimeout(done, AGAIN_MS));

// Send an action until the study has stored it; the answer is the page that follows.
async function send(action) {
  if (sending) return;
  sending = true;
  const body = JSON.stringify({ page: current.page, ...action });
  let answer = null;
  while (!answer) {
    try {
      const reply = await fetch("/event", { method: "POST", body, signal: AbortSignal.timeout(15000) });
      if (reply.ok || reply.status === 409) answer = await reply.json();
    } catch { /* sent again below */ }
    byId("notice").textContent = answer ? ""
      : "This could not be saved yet. Nothing is lost: please leave this page open, it tries again by itself.";
    if (!answer) await pause();
  }
  sending = false;
  show(answer);
}

// Follow the session: a head's presentation ends by the clock of the study.
async function follow() {
  while (current?.step !== "end") {
    try {
      const page = await (await fetch("/page", { signal: AbortSignal.timeout(15000) })).json();
      byId("notice").textContent = "";
      if (!sending && page.page !== current?.page) show(page, current === null);
    } catch {
      byId("notice").textContent = "The connection is interrupted. Nothing that you answered is lost, and the page continues by itself.";
    }
    await pause();
  }
}

// --- the pages --------------------------------------------------------------------------------------

function show(page, reloaded = false) {
  current = page;
  stop.hidden = page.step === "consent" || page.step === "end";
  if (stop.hidden) leave.close();
  const trial = page.trial ?? -page.practice;
  const place = page.trial === null ? "" : `${trial + page.practice + 1} of ${page.count}${trial < 0 ? ", practice" : ""}`;
  byId("where").textContent = place;
  sheet.className = page.step;
  sheet.replaceChildren(...PAGES[page.step](page, reloaded));
  scrollTo(0, 0);
  sheet.querySelector("h1")?.focus({ preventScroll: true });
}

function consent(page) {
  const agree = make("input", { type: "checkbox", id: "agree" });
  const missing = make("p", { className: "wrong", role: "alert" });
  const accept = button("I take part", () => {
    missing.textContent = agree.checked ? "" : "To take part, please tick the box.";
    if (agree.checked) send({ do: "consent" });
    else agree.focus();
  });
  const decline = make("button", { type: "button" }, "No, thank you");
  decline.addEventListener("click", () => send({ do: "decline" }));
  return [
    title("Before you begin"),
    ...paragraphs(
      ...page.welcome,
      `You will see ${page.count} ${page.pairs ? "pairs of " : ""}${page.film ? "short films of a robot’s head" : "presentations of the robot in front of you"}, about ${Math.round(page.seconds)} seconds each, and answer questions after each ${page.pairs ? "pair" : "one"}.`,
      page.practice ? `The first ${page.practice === 1 ? "is" : page.practice + " are"} for practice.` : "",
      "There are no right or wrong answers. With a keyboard: Tab goes from question to question, the number keys choose an answer, Enter continues.",
      "Taking part is voluntary. You can stop at any time without giving a reason: press Esc or the button “Stop taking part”.",
      `Your answers and how long they took are kept under the code ${page.code}. Your name is not asked for.`,
      page.film ? "" : "The robot sees you with a camera. Its pictures are used at once and are not kept.",
      contact(page),
    ),
    make("p", { className: "tick" }, agree, make("label", { htmlFor: "agree" }, "I have read this and take part voluntarily.")),
    missing, accept, decline,
  ];
}

const contact = (page) => (page.contact
  ? `To ask questions, or to have your data deleted later, write to ${page.contact} and give your code.`
  : "To have your data deleted later, give the experimenter your code.");

function ready(page) {
  const seconds = Math.round(page.seconds);
  return [
    title("Are you ready?"),
    ...paragraphs(
      page.pairs ? `This is the ${page.side ? "second" : "first"} of two.` : "",
      page.film
        ? `The film lasts about ${seconds} seconds and starts when you press the button. Please watch it to the end.`
        : `Please look at the robot when you have pressed the button, for about ${seconds} seconds. This page shows when it is over.`,
    ),
    button("I am ready", () => send({ do: "begin" })),
  ];
}

function presentation(page, reloaded) {
  if (!page.film) return [title("Look at the robot"), ...paragraphs("The page continues by itself.")];
  if (reloaded) { // the film has to be seen in one piece
    send({ do: "seen" });
    return [];
  }
  const video = make("video", { muted: true, playsInline: true, tabIndex: -1, ariaLabel: "Film of the robot’s head" });
  video.addEventListener("ended", () => send({ do: "seen" }));
  play(video, page.page);
  return [video];
}

// The whole film is fetched before it starts, so that it never stalls.
async function play(video, name) {
  while (current.page === name) {
    try {
      const reply = await fetch(`/film/${name}`);
      if (!reply.ok) throw new Error(reply.statusText);
      video.src = URL.createObjectURL(await reply.blob());
      return await video.play();
    } catch {
      byId("notice").textContent = "The film cannot be shown yet. If this stays, please tell the experimenter.";
      await pause();
    }
  }
}

function end(page) {
  return [
    title("Thank you"),
    ...paragraphs(
      ...page.debriefing,
      page.finished ? "You have reached the end and can close this page." : "Your session has ended. You can close this page.",
      `Your code is ${page.code}. ${contact(page)}`,
    ),
  ];
}

// --- questions --------------------------------------------------------------------------------------

// Answers stay in the tab until they are stored, so that a reload loses nothing.
function draft(name) {
  try {
    return JSON.parse(sessionStorage.getItem(name)) ?? {};
  } catch {
    return {};
  }
}

function questions(page) {
  const answers = draft(page.page); // number of the question -> {value, ms}
  const since = performance.now();
  const elapsed = () => Math.round(performance.now() - since);
  const isOpen = (i) => page.items[i].kind !== "text" && !(i in answers);
  const answer = (i, value) => {
    answers[i] = { value, ms: elapsed() };
    sessionStorage.clear();
    sessionStorage.setItem(page.page, JSON.stringify(answers));
    fields[i].classList.remove("open");
  };
  const fields = page.items.map((item, i) => field(item, i, answers[i]?.value, (value) => answer(i, value)));
  const missing = make("p", { className: "wrong", role: "alert" });
  const form = make(
    "form", { noValidate: true }, title("Your impression"),
    ...paragraphs(page.instruction),
    ...fields, missing, make("button", { type: "submit", className: "main" }, "Next"),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const open = fields.filter((_, i) => isOpen(i));
    for (const one of open) one.classList.add("open");
    missing.textContent = open.length ? `Please answer ${open.length} more.` : "";
    if (open.length) return focus(open[0]);
    send({
      do: "answer",
      values: page.items.map((item, i) => answers[i]?.value ?? (item.kind === "text" ? "" : null)),
      ms: page.items.map((_, i) => answers[i]?.ms ?? elapsed()),
    });
  });
  // 1 ... 9, and 0 for 10, answer the question in focus, or the first open one.
  form.addEventListener("keydown", (event) => {
    if (event.target.tagName === "TEXTAREA" || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Enter" && event.target.type === "radio") {
      event.preventDefault();
      return form.requestSubmit();
    }
    if (!/^[0-9]$/.test(event.key)) return;
    const here = fields.findIndex((one) => one.contains(document.activeElement));
    const at = here >= 0 ? here : fields.findIndex((_, i) => isOpen(i));
    const radio = fields[at]?.querySelectorAll("input")[(Number(event.key) || 10) - 1];
    if (!radio) return;
    event.preventDefault();
    radio.click();
    if (fields[at + 1]) focus(fields[at + 1]);
    else form.querySelector("button").focus();
  });
  return [form];
}

const focus = (element) => (element.querySelector("input:checked, input, textarea") ?? element).focus();

function field(item, i, value, changed) {
  if (item.kind === "text") {
    const area = make("textarea", { id: `item-${i}`, rows: 4, maxLength: 5000, value: value ?? "" });
    area.addEventListener("input", () => changed(area.value));
    return make("div", { className: "item" }, make("label", { htmlFor: area.id }, item.text), area);
  }
  const choice = item.kind === "choice";
  const steps = choice ? ["first", "second"] : Array.from({ length: item.points }, (_, k) => k + 1);
  const options = steps.map((step) => {
    const radio = make("input", { type: "radio", name: `item-${i}`, checked: step === value });
    radio.addEventListener("change", () => changed(step));
    return make("label", { className: "step" }, radio, choice ? `The ${step}` : String(step));
  });
  const asked = item.text || `${item.low} – ${item.high}`;
  return make(
    "fieldset", { className: "item" }, make("legend", {}, asked),
    make("div", { className: "scale" }, make("span", { className: "low" }, item.low ?? ""),
      make("span", { className: "steps" }, ...options), make("span", {}, item.high ?? "")),
  );
}

// --- the start --------------------------------------------------------------------------------------

const PAGES = { consent, ready, presentation, questions, end };
stop.addEventListener("click", () => leave.showModal());
byId("leave-no").addEventListener("click", () => leave.close());
byId("leave-yes").addEventListener("click", () => {
  leave.close();
  send({ do: "leave" });
});
document.addEventListener("keydown", (event) => {
  if (leave.open) return;
  if (event.key === "Escape" && !stop.hidden) {
    event.preventDefault();
    leave.showModal();
  }
  // Enter continues also before the keyboard has reached the button.
  const nowhere = event.target === document.body || event.target.tagName === "H1";
  if (event.key === "Enter" && nowhere && !event.repeat) sheet.querySelector("button.main")?.click();
});
follow();
