// Elements and texts of the page.

let texts = {};

// Take the texts of the document's language.
export async function readTexts() {
  const all = await (await fetch("/study/texts.json")).json();
  texts = all[document.documentElement.lang] ?? all.en;
}

// Return a text with its places filled: say("trial", {n: 2, of: 8}).
export function say(key, values = {}) {
  return texts[key].replace(/\{(\w+)\}/g, (_, name) => String(values[name]));
}

// Return a new element: make("p", {className: "note"}, "text", another element, ...).
export function make(tag, properties = {}, ...inside) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...inside);
  return made;
}

export function paragraphs(lines) {
  return lines.map((line) => make("p", {}, line));
}

// Return a button that does something when it is pressed.
export function button(key, does, kind = "main") {
  const made = make("button", { type: "button", className: kind }, say(key));
  made.addEventListener("click", does);
  return made;
}
