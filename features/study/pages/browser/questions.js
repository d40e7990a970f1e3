// A page of questions: scales, a choice of two, free text. Nothing is chosen beforehand.

import { make, say } from "./elements.js";

const TEXT_LENGTH = 4000;

// What was answered stays in the tab until it is kept, so that a reload loses nothing.
const draft = {
  key: (page) => `gazerig-study-${page}`,
  read(page) {
    try {
      return JSON.parse(sessionStorage.getItem(this.key(page))) ?? {};
    } catch {
      return {};
    }
  },
  write(page, answers) {
    try {
      sessionStorage.setItem(this.key(page), JSON.stringify(answers));
    } catch { /* a browser that keeps nothing: the answers stand in the page alone */ }
  },
  forget(page) {
    try {
      for (const key of Object.keys(sessionStorage)) {
        if (key.startsWith("gazerig-study-") && key !== this.key(page)) sessionStorage.removeItem(key);
      }
    } catch { /* nothing was kept */ }
  },
};

// Return the form of a page; ``send`` takes its answers once all that must be are there.
export function questions(page, send) {
  draft.forget(page.page);
  const since = performance.now();
  const answers = draft.read(page.page);
  const left = make("p", { className: "note", role: "status" });
  const next = make("button", { type: "submit", className: "main" }, say("next"));
  const fields = page.items.map((item) => field(item, answers[item.key]?.value, (value) => {
    answers[item.key] = { value, ms: Math.round(performance.now() - since) };
    draft.write(page.page, answers);
    count();
  }));

  const unanswered = () => fields.filter(({ item }) => needed(item) && !(item.key in answers));
  const missing = () => (page.may_skip ? [] : unanswered());

  function count() {
    const open = unanswered();
    left.textContent = open.length ? say("questions.left", { count: open.length }) : say("questions.all");
    next.setAttribute("aria-disabled", String(missing().length > 0));
    for (const one of fields) if (!open.includes(one)) one.complain(false);
  }

  const form = make(
    "form", { noValidate: true, className: "questions" },
    make("h1", { tabIndex: -1 }, say(page.after ? "questions.after" : "questions.title")),
    ...(page.instruction ? [make("p", { lang: page.instruction_language }, page.instruction)] : []),
    ...(page.may_skip ? [make("p", { className: "note" }, say("questions.may_skip"))] : []),
    ...fields.map((one) => one.element),
    make("div", { className: "foot" }, left, next),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const open = missing();
    for (const one of open) one.complain(true);
    if (open.length) return open[0].focus();
    send({
      do: "answer",
      answers: fields.map(({ item }) => ({
        key: item.key,
        value: answers[item.key]?.value ?? (needed(item) ? null : ""),
        ms: answers[item.key]?.ms ?? Math.round(performance.now() - since),
      })),
    });
  });
  form.addEventListener("keydown", (event) => digit(event, form, fields, answers));
  count();
  return form;
}

function needed(item) {
  return item.kind !== "text";
}

// 1 ... 9 and 0 for 10 choose an answer of the question in focus, or of the first open one, and
// lead to the next.
function digit(event, form, fields, answers) {
  if (event.key === "Enter" && event.target.type === "radio") {
    event.preventDefault();
    return form.requestSubmit();
  }
  if (event.target.tagName === "TEXTAREA" || event.ctrlKey || event.altKey || event.metaKey) return;
  if (!/^[0-9]$/.test(event.key)) return;
  const here = fields.findIndex(({ element }) => element.contains(document.activeElement));
  const at = here >= 0 ? here : fields.findIndex(({ item }) => needed(item) && !(item.key in answers));
  if (at < 0 || !fields[at].choose) return;
  if (!fields[at].choose(Number(event.key) || 10)) return;
  event.preventDefault();
  (fields[at + 1] ?? { focus: () => form.querySelector("button[type=submit]").focus() }).focus();
}

function field(item, value, changed) {
  return item.kind === "text" ? text(item, value, changed) : scale(item, value, changed);
}

function text(item, value, changed) {
  const id = `answer-${item.key}`;
  const area = make("textarea", { id, rows: 4, maxLength: TEXT_LENGTH, value: value ?? "" });
  area.addEventListener("input", () => changed(area.value));
  const element = make(
    "div", { className: "item" },
    make("label", { htmlFor: id, lang: item.language }, item.text),
    make("p", { className: "note" }, say("questions.optional")),
    area,
  );
  return { item, element, focus: () => area.focus(), complain: () => {} };
}

// Return the values of an item and what is written at each.
function steps(item) {
  if (item.kind === "choice") {
    return ["first", "second"].map((value) => [value, say(`questions.${value}`)]);
  }
  return Array.from({ length: item.points }, (_, i) => [i + 1, String(i + 1)]);
}

function scale(item, value, changed) {
  const wrong = make("p", { className: "wrong", id: `wrong-${item.key}`, hidden: true }, say("questions.missing"));
  const options = steps(item).map(([step, words], at, all) => {
    const radio = make("input", { type: "radio", name: item.key, checked: step === value });
    radio.addEventListener("change", () => changed(step));
    if (item.kind === "rating") radio.setAttribute("aria-label", spoken(item, at, all.length));
    return { radio, element: make("label", { className: "step" }, radio, make("span", {}, words)) };
  });
  const anchor = (side) => make("span", { className: `anchor ${side}`, lang: item.language, "aria-hidden": "true" }, item[side]);
  const row = item.kind === "choice"
    ? make("div", { className: "choice" }, ...options.map(({ element }) => element))
    : make("div", { className: "scale" }, anchor("low"),
      make("div", { className: "steps" }, ...options.map(({ element }) => element)), anchor("high"));
  const asks = item.text || `${item.low} – ${item.high}`;
  const legend = make("legend", { lang: item.language, className: item.text ? "" : "read-out" }, asks);
  const element = make("fieldset", { className: "item" }, legend, row, wrong);
  return {
    item,
    element,
    focus: () => (options.find(({ radio }) => radio.checked) ?? options[0]).radio.focus(),
    choose(number) {
      options[number - 1]?.radio.click();
      return number <= options.length;
    },
    complain(on) {
      wrong.hidden = !on;
      element.classList.toggle("open", on);
      if (on) element.setAttribute("aria-describedby", wrong.id);
      else element.removeAttribute("aria-describedby");
    },
  };
}

// What a screen reader says of a step: its number, and the anchor at the ends.
function spoken(item, at, count) {
  const place = say("questions.point", { n: at + 1, of: count });
  const end = at === 0 ? item.low : at === count - 1 ? item.high : "";
  return end ? `${place}, ${end}` : place;
}
