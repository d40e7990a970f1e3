// Elements of the panels: words, sections and controls.
//
// A control is {node, show(value)}. While a person uses it, `show` does not change it.

const DRAG_MS = 50; // shortest time between two values of a dragged slider
const STALE_MS = 2500, AGE_MS = 500;

/** Create an element with properties and children. */
export function make(name, props = {}, ...children) {
  const node = Object.assign(document.createElement(name), props);
  node.append(...children);
  return node;
}

/** Set a text if it has changed, so that a screen reader reads it once. */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export const note = (text) => make("div", { className: "note", textContent: text });
export const chip = (text) => make("span", { className: "chip", textContent: text });
export const pill = (text, kind) => make("span", { className: `pill-word ${kind}`, textContent: text });

/** Show a picture in grey and with its age if none has come after it; freshAt: returns its time. */
export function showAge(place, freshAt) {
  const age = make("p", { className: "age", hidden: true });
  place.append(age);
  setInterval(() => {
    const old = performance.now() - freshAt();
    age.hidden = old <= STALE_MS;
    place.classList.toggle("stale", !age.hidden);
    if (!age.hidden) write(age, `as it was ${Math.round(old / 1000)} s ago`);
  }, AGE_MS);
}

/** Heading of a table or drawing, with smaller text at its right end. */
export function heading(text, aside = "") {
  return make("div", { className: "heading" }, text, make("span", { textContent: aside }));
}

/** Section that can be folded: {node, body}. */
export function section(title, open = true) {
  const body = make("div", { className: "section" });
  const node = make("details", { open }, make("summary", { textContent: title }), body);
  return { node, body };
}

/** Table; head and rows: lists of cells, which are text or elements. */
export function table(head, rows) {
  const cells = (kind, row) => row.map((cell, i) => (
    cell instanceof Node && /^T[DH]$/.test(cell.nodeName) ? cell : make(i ? kind : "th", {}, cell)));
  const lines = rows.map((row) => make("tr", {}, ...cells("td", row)));
  for (const line of lines) line.firstChild.scope = "row";
  const top = make("tr", {}, ...cells("th", head));
  return make("div", { className: "scroll" },
    make("table", {}, make("thead", {}, top), make("tbody", {}, ...lines)));
}

// --- controls -----------------------------------------------------------------------------------

let numbers = 0;
const newId = () => `control-${++numbers}`;

/** Add a tooltip to a control, also for screen readers. */
function describe(node, hint) {
  if (!hint) return;
  node.title = hint;
  node.setAttribute("aria-description", hint);
}

/** Name a control; names can break after their dots and underscores. */
function label(text, id) {
  const parts = text.split(/(?<=[._])/).flatMap((part) => [part, make("wbr")]);
  return make("label", { htmlFor: id }, make("span", { className: "unsaved" }), ...parts);
}

/** Mark a control whose value differs from the rig's file. */
export function markUnsaved(control, unsaved) {
  control.node.querySelector(".unsaved").textContent = unsaved ? "● " : "";
}

/** Send values one after another; of those that come meanwhile only the last one is sent. */
function inTurn(send) {
  let busy = false, waiting = [];
  return async function next(value) {
    waiting = [value];
    if (busy) return;
    busy = true;
    while (waiting.length) {
      const pause = new Promise((resolve) => { setTimeout(resolve, DRAG_MS); });
      await Promise.allSettled([send(waiting.pop()), pause]);
    }
    busy = false;
  };
}

/** Text of a number, without the noise of binary fractions. */
const written = (value) => String(Number(value.toPrecision(6)));

/**
 * Let a person type into a field: Enter commits, Escape restores the value in force.
 * Returns {isTyped(): whether there is text that is not committed, commit()}.
 */
function typing(field, restore, take) {
  const isTyped = () => field.classList.contains("typed");
  const mark = (typed) => field.classList.toggle("typed", typed);
  const commit = () => {
    mark(false);
    take();
  };
  field.addEventListener("input", () => mark(true));
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter") commit();
    if (event.key !== "Escape" || !isTyped()) return;
    event.stopPropagation(); // it closes no drawer
    restore();
    mark(false);
  });
  return { isTyped, commit };
}

/**
 * Slider between two ends, whose number can also be typed.
 * options: {name, unit, low, high, step, value, hint}; send: gets each new value
 */
export function slider({ name, unit = "", low, high, step, value, hint = "" }, send) {
  const id = newId();
  const range = make("input", { id, type: "range", min: low, max: high, step });
  const number = make("input", { type: "number", className: "number", min: low, max: high, step });
  number.setAttribute("aria-label", `${name}, as a number${unit && ` in ${unit}`}`);
  for (const field of [range, number]) describe(field, hint);
  let current = value, held = false;
  const draw = () => { range.value = current; number.value = written(current); };
  const set = inTurn(async (next) => {
    current = next;
    await send(next);
  });
  range.addEventListener("input", () => { number.value = range.value; set(Number(range.value)); });
  range.addEventListener("pointerdown", () => { held = true; });
  for (const end of ["pointerup", "pointercancel", "blur"]) {
    range.addEventListener(end, () => { held = false; });
  }
  const { isTyped, commit } = typing(number, draw, () => {
    const next = number.valueAsNumber;
    if (Number.isNaN(next)) draw();
    else if (next !== Number(written(current))) set(next);
  });
  number.addEventListener("change", commit); // by its arrow keys, or when the focus leaves
  number.addEventListener("wheel", () => number.blur()); // scrolling must not move a joint
  const field = make("span", { className: "with-unit" },
    number, make("span", { className: "unit", textContent: unit }));
  draw();
  return {
    node: make("div", { className: "field" }, label(name, id),
      make("div", { className: "both" }, range, field)),
    show(next) {
      if (held || isTyped()) return;
      current = next;
      draw();
    },
  };
}

/** Text field, sent at Enter or when the focus leaves; `enterOnly`: at Enter, also unchanged. */
export function textField({ name, value = "", hint = "", enterOnly = false }, send) {
  const id = newId();
  const field = make("input", { id, type: "text", autocomplete: "off", spellcheck: false, value });
  describe(field, hint);
  let current = value;
  const { isTyped, commit } = typing(field, () => { field.value = current; }, () => {
    if (field.value === current && !enterOnly) return;
    current = field.value;
    send(current);
  });
  field.addEventListener("blur", () => { if (!enterOnly) commit(); });
  return {
    node: make("div", { className: "field" }, label(name, id), field),
    show(next) {
      current = next;
      if (!isTyped()) field.value = next;
    },
  };
}

export function checkbox({ name, value = false, hint = "" }, send = () => {}) {
  const id = newId(), box = make("input", { id, type: "checkbox", checked: value });
  describe(box, hint);
  box.addEventListener("change", () => send(box.checked));
  return {
    node: make("div", { className: "tick" }, box, label(name, id)),
    show(next) { box.checked = next; },
    get value() { return box.checked; },
  };
}

/** Row of buttons, of which `show` marks the present one; title: text above, "" for none. */
export function buttons(title, options, send, hint = "") {
  const row = make("div", { className: "buttons" });
  const node = make("div", { className: "group" }, row);
  node.setAttribute("role", "group");
  if (title) {
    const id = newId();
    node.prepend(make("div", { className: "label", id }, make("span", { className: "unsaved" }), title));
    node.setAttribute("aria-labelledby", id);
  }
  for (const option of options) {
    const button = make("button", { type: "button", textContent: option.replaceAll("_", " ") });
    button.dataset.choice = option;
    describe(button, hint);
    button.addEventListener("click", () => send(option));
    row.append(button);
  }
  return {
    node,
    show(present) {
      for (const button of row.children) {
        button.setAttribute("aria-pressed", String(button.dataset.choice === present));
      }
    },
  };
}
