// @ts-check
// Panels of the page: native elements, described by the Python side.
//
// /rig/panels sends {"put": [[number, properties]], "gone": [numbers], "say": [notices]}, and
// images as bytes after the number of their element. It receives {"set": [number, value]}, and
// {"seen": [names]} so that hidden panels are not sent. A field with the focus keeps the user's input
// until the focus leaves.

/**
 * @typedef {Object} Props Properties of an element; which are present depends on its kind.
 * @property {string} kind
 * @property {string | number} in
 * @property {number} order
 * @property {string} label
 * @property {string} title
 * @property {string} hint
 * @property {string} content
 * @property {any} value
 * @property {string[]} options
 * @property {string} current
 * @property {boolean} pick
 * @property {boolean} open
 * @property {string} on
 * @property {number} low
 * @property {number} high
 * @property {number} step
 * @property {string} unit
 * @property {number} least
 * @property {[string, string][]} lines
 * @property {number[]} x
 * @property {number[][]} y
 *
 * @typedef {Object} Part An element on the page.
 * @property {HTMLElement} node
 * @property {HTMLElement} [body] container of its children
 * @property {(props: Props, changed: Partial<Props>) => void} show
 * @property {(data: Blob) => void} [paint]
 *
 * @typedef {(value: any) => void} Send
 */

import { drawChart } from "./chart.js";

const AGAIN_MS = 500;
const DRAG_MS = 50; // shortest time between values of a dragged slider
const NOTICE_MS = 8000, REFUSED_MS = 14000;
const NUMBER_BYTES = 4;
const PICK_STEP = 0.04;
const STALE_MS = 2000, AGE_MS = 500;

/** @type {(name: string, props?: Record<string, any>, ...children: Node[]) => any} */
function make(name, props = {}, ...children) {
  const node = Object.assign(document.createElement(name), props);
  node.append(...children);
  return node;
}

/**
 * Limit the rate of calls; the last one is always made.
 * @param {(value: any) => void} does
 * @param {number} ms
 */
function seldom(does, ms) {
  let due = 0, last;
  return (value) => {
    last = value;
    if (due) return;
    due = window.setTimeout(() => { due = 0; does(last); }, ms);
  };
}

/** Allow line breaks in a name after its dots and underscores. */
function name(label, text) {
  if (label.textContent === text) return;
  label.replaceChildren(...text.split(/(?<=[._])/).flatMap((part) => [part, make("wbr")]));
}

/** Rectangle of an image in the window, fitted into its element. */
function drawnBox(image) {
  const box = image.getBoundingClientRect();
  const scale = Math.min(box.width / image.naturalWidth, box.height / image.naturalHeight);
  const width = scale * image.naturalWidth, height = scale * image.naturalHeight;
  return {
    left: box.left + (box.width - width) / 2, top: box.top + (box.height - height) / 2, width, height,
  };
}

/** Text of a number, without the noise of binary fractions. */
function written(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(12))) : String(value);
}

// --- kinds of elements ------------------------------------------------------------------------

/** @type {Record<string, (id: string, send: Send) => Part>} */
const KINDS = {
  html() {
    const node = make("div", { className: "html" });
    return { node, show(props, changed) {
      if (changed.content === undefined) return;
      node.innerHTML = props.content; // the Python side has escaped all names in it
      node.hidden = !props.content;
    } };
  },

  section() {
    const title = make("summary"), body = make("div", { className: "section" });
    const node = make("details", {}, title, body);
    return { node, body, show(props, changed) {
      title.textContent = props.title;
      if (changed.open !== undefined) node.open = props.open;
    } };
  },

  image() {
    const image = make("img", { decoding: "async", draggable: false });
    const mark = make("span", { className: "mark", hidden: true });
    const age = make("p", { className: "age", hidden: true });
    const node = make("div", { className: "picture", hidden: true }, image, mark, age);
    let paintedAt = 0, lives = false; // other pictures change seldom
    const timer = window.setInterval(() => {
      if (paintedAt && !node.isConnected) return window.clearInterval(timer);
      const old = performance.now() - paintedAt;
      const stale = lives && old > STALE_MS && !node.hidden;
      node.classList.toggle("stale", stale);
      age.hidden = !stale;
      if (stale) age.textContent = `${Math.round(old / 1000)} s old`;
    }, AGE_MS);
    let at = [0.5, 0.5], pick = false;
    const ask = () => {
      window.rig.ask({ pick: { x: at[0], y: at[1] } })
        .catch((error) => say(`the click did not reach the rig: ${error.message.trim()}`, true));
    };
    image.addEventListener("click", (event) => {
      if (!pick) return;
      const box = drawnBox(image);
      at = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
      if (at.every((place) => place >= 0 && place <= 1)) ask();
    });
    image.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!pick || (!way && event.key !== "Enter")) return;
      event.preventDefault();
      if (!way) return ask();
      at = at.map((place, axis) => Math.min(1, Math.max(0, place + PICK_STEP * way[axis])));
      const box = drawnBox(image), around = node.getBoundingClientRect();
      mark.hidden = false;
      mark.style.left = `${box.left - around.left + at[0] * box.width}px`;
      mark.style.top = `${box.top - around.top + at[1] * box.height}px`;
    });
    image.addEventListener("blur", () => { mark.hidden = true; });
    return {
      node,
      show(props) {
        pick = lives = props.pick;
        image.alt = props.label;
        image.classList.toggle("pick", pick);
        if (!pick) return;
        image.tabIndex = 0;
        image.setAttribute("role", "button");
        image.title = "click: the head looks there (or move the cross by the arrow keys, and Enter)";
      },
      paint(data) {
        paintedAt = performance.now();
        const url = URL.createObjectURL(data), before = image.src;
        image.src = url;
        node.hidden = false;
        if (before) URL.revokeObjectURL(before);
      },
    };
  },

  chart() {
    const title = make("figcaption"), canvas = make("canvas");
    const node = make("figure", { className: "chart" }, title, canvas);
    canvas.setAttribute("role", "img");
    let last = /** @type {Props | null} */ (null);
    const draw = () => { if (last) canvas.setAttribute("aria-label", drawChart(canvas, last)); };
    new ResizeObserver(draw).observe(node);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    return { node, show(props) {
      last = props;
      title.textContent = props.title;
      if (node.offsetWidth) draw();
    } };
  },

  text(id, send) {
    const label = make("label", { htmlFor: id });
    const field = make("input", { id, type: "text", autocomplete: "off", spellcheck: false });
    let on = "left", force = "";
    const shown = () => { field.value = force; field.classList.remove("typed"); };
    const commit = () => {
      if (field.value !== force || on === "enter") { force = field.value; send(force); }
      field.classList.remove("typed");
    };
    field.addEventListener("input", () => { field.classList.add("typed"); });
    field.addEventListener("keydown", (event) => {
      if (event.key === "Enter") commit();
      if (event.key === "Escape" && field.value !== force) {
        event.stopPropagation(); // it closes no drawer
        shown();
      }
    });
    field.addEventListener("blur", () => { if (on === "left") commit(); });
    return { node: make("div", { className: "field" }, label, field), show(props, changed) {
      name(label, props.label);
      describe(field, props.hint);
      on = props.on;
      if (changed.value === undefined) return;
      force = props.value;
      if (document.activeElement !== field || !field.classList.contains("typed")) shown();
    } };
  },

  slider(id, send) {
    const label = make("label", { htmlFor: id });
    const range = make("input", { id, type: "range" });
    const number = make("input", { type: "number", className: "number" });
    let force = 0, held = false;
    const shown = () => { range.value = String(force); number.value = written(force); };
    const set = (value) => { force = value; shown(); send(value); };
    const drag = seldom((value) => set(value), DRAG_MS);
    range.addEventListener("input", () => { number.value = range.value; drag(Number(range.value)); });
    range.addEventListener("pointerdown", () => { held = true; });
    for (const end of ["pointerup", "pointercancel", "blur"]) {
      range.addEventListener(end, () => { held = false; });
    }
    const commit = () => {
      number.classList.remove("typed");
      const value = number.valueAsNumber;
      if (Number.isNaN(value)) shown();
      else if (value !== force) set(value);
    };
    number.addEventListener("input", () => { number.classList.add("typed"); });
    number.addEventListener("keydown", (event) => {
      if (event.key === "Enter") commit();
      if (event.key === "Escape" && number.classList.contains("typed")) {
        event.stopPropagation();
        number.classList.remove("typed");
        shown();
      }
    });
    number.addEventListener("change", commit); // by its arrows, or when the focus leaves
    number.addEventListener("blur", commit);
    number.addEventListener("wheel", () => { number.blur(); }); // scrolling must not move a joint
    const both = make("div", { className: "both" }, range, number);
    return { node: make("div", { className: "field" }, label, both), show(props, changed) {
      name(label, props.label);
      number.setAttribute("aria-label", `${props.label}, as a number`);
      for (const field of [range, number]) {
        field.min = String(props.low);
        field.max = String(props.high);
        field.step = String(props.step);
        describe(field, props.hint);
      }
      if (changed.value !== undefined) force = props.value;
      if (!held && !number.classList.contains("typed")) shown();
    } };
  },

  checkbox(id, send) {
    const box = make("input", { id, type: "checkbox" });
    const label = make("label", { htmlFor: id });
    box.addEventListener("change", () => send(box.checked));
    return { node: make("div", { className: "tick" }, box, label), show(props, changed) {
      name(label, props.label);
      describe(box, props.hint);
      if (changed.value !== undefined) box.checked = props.value;
    } };
  },

  choice(id, send) {
    const label = make("label", { htmlFor: id }), menu = make("select", { id });
    menu.addEventListener("change", () => send(menu.value));
    return { node: make("div", { className: "field" }, label, menu), show(props, changed) {
      name(label, props.label);
      describe(menu, props.hint);
      if (changed.options) {
        menu.replaceChildren(...props.options.map((one) => make("option", { value: one, textContent: one })));
      }
      if (changed.options || changed.value !== undefined) menu.value = props.value;
    } };
  },

  buttons(id, send) {
    const label = make("div", { className: "label", id });
    const row = make("div", { className: "buttons" });
    const node = make("div", { className: "group" }, label, row);
    node.setAttribute("role", "group");
    node.setAttribute("aria-labelledby", id);
    return { node, show(props, changed) {
      label.textContent = props.label;
      label.hidden = !props.label;
      if (changed.options) {
        while (row.children.length > props.options.length) row.lastElementChild?.remove();
        while (row.children.length < props.options.length) {
          const button = make("button", { type: "button" });
          button.addEventListener("click", () => send(button.textContent));
          row.append(button);
        }
        props.options.forEach((one, i) => { row.children[i].textContent = one; });
      }
      for (const button of row.children) {
        describe(button, props.hint);
        if (props.current) {
          button.setAttribute("aria-pressed", String(button.textContent === props.current));
        } else button.removeAttribute("aria-pressed");
      }
    } };
  },
};

/** Add a tooltip to a control, also for screen readers. */
function describe(node, hint) {
  if (!hint) return;
  node.title = hint;
  node.setAttribute("aria-description", hint);
}

// --- notices ----------------------------------------------------------------------------------

/** @type {HTMLElement} */
let notices;

/** Show a notice for some seconds; a refusal is read out immediately. */
function say(text, refused) {
  const shut = make("button", { type: "button", textContent: "×" });
  shut.setAttribute("aria-label", "close this message");
  const node = make("div", { className: refused ? "notice refused" : "notice" },
    make("span", { textContent: text }), shut);
  node.setAttribute("role", refused ? "alert" : "status");
  shut.addEventListener("click", () => node.remove());
  notices.append(node);
  window.setTimeout(() => node.remove(), refused ? REFUSED_MS : NOTICE_MS);
}

// --- the connection ---------------------------------------------------------------------------

/**
 * Fill the page's panels, [data-panel=NAME], and keep them up to date.
 * @param {Document} page
 */
export function mount(page) {
  /** @type {Map<string, HTMLElement>} */
  const panels = new Map();
  for (const node of /** @type {NodeListOf<HTMLElement>} */ (page.querySelectorAll("[data-panel]"))) {
    panels.set(String(node.dataset.panel), node);
  }
  notices = make("div", { className: "notices" });
  (page.querySelector("#notices") ?? page.body).append(notices);

  /** @type {Map<number, {part: Part, props: Props}>} */
  const known = new Map();
  /** @type {WebSocket | null} */
  let line = null;
  const seen = new Set();

  const tell = (message) => {
    if (line && line.readyState === WebSocket.OPEN) line.send(JSON.stringify(message));
  };
  const tellSeen = () => tell({ seen: [...seen] });

  /** Insert an element by its order among its neighbours. */
  function place(number, node, props) {
    const parent = typeof props.in === "string" ? panels.get(props.in) : known.get(props.in)?.part.body;
    if (!parent) return;
    node.dataset.order = String(props.order);
    node.dataset.number = String(number);
    const after = [...parent.children].find((one) => {
      const order = Number(one.dataset.order);
      return order > props.order || (order === props.order && Number(one.dataset.number) > number);
    });
    parent.insertBefore(node, after ?? null);
  }

  function put(number, changed) {
    let one = known.get(number);
    if (!one) {
      const makes = KINDS[changed.kind];
      if (!makes) return;
      one = { part: makes(`w${number}`, (value) => tell({ set: [number, value] })), props: changed };
      known.set(number, one);
      place(number, one.part.node, changed);
    } else Object.assign(one.props, changed);
    one.part.show(one.props, changed);
  }

  function gone(number) {
    known.get(number)?.part.node.remove();
    known.delete(number);
  }

  async function paint(data) {
    const number = new DataView(data).getUint32(0);
    known.get(number)?.part.paint?.(new Blob([data.slice(NUMBER_BYTES)]));
  }

  function connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const mine = new WebSocket(`${scheme}://${location.host}/rig/panels`);
    mine.binaryType = "arraybuffer";
    line = mine;
    mine.onopen = () => { // everything is sent again
      for (const number of [...known.keys()]) gone(number);
      tellSeen();
    };
    mine.onmessage = (event) => {
      if (typeof event.data !== "string") return void paint(event.data);
      const said = JSON.parse(event.data);
      for (const [number, props] of said.put ?? []) put(number, props);
      for (const number of said.gone ?? []) gone(number);
      for (const notice of said.say ?? []) say(notice.text, notice.refused);
    };
    mine.onclose = () => {
      line = null;
      window.setTimeout(connect, AGAIN_MS);
    };
  }

  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      const name = /** @type {HTMLElement} */ (entry.target).dataset.panel;
      if (entry.isIntersecting) seen.add(name);
      else seen.delete(name);
    }
    tellSeen();
  });
  for (const [name, node] of panels) { // panels outside the drawers are always visible
    if (node.getAttribute("role") === "tabpanel") watcher.observe(node);
    else seen.add(name);
  }
  connect();
}
