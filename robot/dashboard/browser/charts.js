// Charts on a canvas, in the colours of the style sheet: lines over time, and strips of intervals.

const LEFT = 40, RIGHT = 8, TOP = 8, FOOT = 20, LINES_HIGH = 132;
const TICKS = 4;
const FONT_PX = 13, LETTER_PX = 7.4;

/** Prepare a canvas: {pen, width, colour(name)}, null while it is not shown. */
export function prepare(canvas, height) {
  const width = canvas.parentElement?.clientWidth ?? 0, scale = devicePixelRatio || 1;
  const pen = canvas.getContext("2d");
  if (!pen || !width) return null;
  canvas.style.height = `${height}px`;
  const size = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
  const style = getComputedStyle(canvas);
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = `${FONT_PX}px ${style.fontFamily}`;
  pen.fillStyle = style.color;
  pen.lineWidth = 1;
  return { pen, width, colour: (name) => style.getPropertyValue(`--${name}`) || style.color };
}

/** Round step, 1, 2 or 5 times a power of ten, for a number of steps in a span. */
function step(span) {
  const fine = span / TICKS, ten = 10 ** Math.floor(Math.log10(fine));
  return [1, 2, 5, 10].map((n) => n * ten).find((n) => n >= fine) ?? 10 * ten;
}

/** Smallest and largest value of all lines, with a least distance. */
function range(lines, least) {
  const values = lines.flatMap((line) => line.y);
  const low = Math.min(...values), high = Math.max(...values);
  if (!(low <= high)) return [-least / 2, least / 2];
  const more = Math.max(0, least - (high - low)) / 2 + 0.04 * (high - low);
  return [low - more, high + more];
}

/**
 * Draw lines over the seconds before now, and describe them for screen readers.
 * chart: {title, unit, least (smallest range), x, lines: [{name, style, y}]}; a style is a
 * colour --line-STYLE of panels.css
 */
export function drawLines(canvas, { title, unit, least, x, lines }) {
  const ready = prepare(canvas, LINES_HIGH);
  if (!ready) return;
  const { pen, width, colour } = ready;
  const [low, high] = range(lines, least), start = Math.min(x[0] ?? 0, -0.5);
  const across = (value) => LEFT + ((value - start) / -start) * (width - LEFT - RIGHT);
  const up = (value) => LINES_HIGH - FOOT - ((value - low) / (high - low)) * (LINES_HIGH - FOOT - TOP);

  pen.strokeStyle = colour("line-grid");
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  const by = step(high - low);
  for (let value = Math.ceil(low / by) * by; value <= high; value += by) {
    pen.beginPath();
    pen.moveTo(LEFT, up(value));
    pen.lineTo(width - RIGHT, up(value));
    pen.stroke();
    pen.fillText(String(Number(value.toFixed(6))), LEFT - 5, up(value));
  }
  pen.textBaseline = "top";
  const every = step(-start);
  for (let value = 0; value >= start - 1e-9; value -= every) {
    pen.textAlign = value === 0 ? "right" : "center";
    const text = value === 0 ? "now" : `${Number(value.toFixed(6))} s`;
    pen.fillText(text, value === 0 ? width - RIGHT : across(value), LINES_HIGH - FOOT + 5);
  }
  for (const { style, y } of lines) {
    pen.strokeStyle = colour(`line-${style}`);
    pen.lineWidth = style === "measured" || style === "estimated" ? 2 : 1.5;
    pen.setLineDash(style === "estimated" ? [6, 4] : []);
    pen.beginPath();
    y.forEach((value, n) => (n ? pen.lineTo(across(x[n]), up(value)) : pen.moveTo(across(x[n]), up(value))));
    pen.stroke();
  }
  pen.setLineDash([]);
  const said = lines.filter(({ y }) => y.length).map(({ name, y }) => (
    `${name} now ${y.at(-1).toFixed(1)}, from ${Math.min(...y).toFixed(1)} to ${Math.max(...y).toFixed(1)}`
  ));
  canvas.setAttribute("aria-label",
    `${title}, last ${Math.round(-start)} s, ${unit}: ${said.join("; ") || "nothing yet"}`);
}

const STRIP_LEFT = 72, AXIS_HIGH = 22;

/**
 * Draw rows of bars over the seconds before now.
 * rows: [{name, high, bars: [{from_s, to_s, colour, text, share (of the height)}]}], times from -over_s to 0
 */
export function drawStrip(canvas, rows, over_s) {
  const gap = 5, height = rows.reduce((sum, { high }) => sum + high + gap, 0) + AXIS_HIGH;
  const ready = prepare(canvas, height);
  if (!ready) return;
  const { pen, width, colour } = ready;
  const ink = pen.fillStyle, foot = height - AXIS_HIGH, right = width - RIGHT;
  const across = (t_s) => right + (Math.max(-over_s, t_s) / over_s) * (right - STRIP_LEFT);
  pen.textBaseline = "middle";
  let top = 0;
  for (const { name, high, bars } of rows) {
    pen.fillStyle = ink;
    pen.textAlign = "left";
    pen.fillText(name, 0, top + high / 2 + 1);
    for (const bar of bars) {
      const x = across(bar.from_s), wide = Math.max(1.2, across(bar.to_s) - x - 0.3);
      const tall = high * (bar.share ?? 1);
      pen.fillStyle = colour(bar.colour);
      pen.fillRect(x, top + high - tall, wide, tall);
      if (bar.text && wide > LETTER_PX * bar.text.length + 6) {
        pen.fillStyle = "#fff";
        pen.fillText(bar.text, x + 4, top + high / 2 + 1);
      }
    }
    top += high + gap;
  }
  pen.fillStyle = pen.strokeStyle = ink;
  pen.beginPath();
  pen.moveTo(STRIP_LEFT, foot);
  pen.lineTo(right, foot);
  pen.textBaseline = "top";
  for (let t_s = -over_s; t_s <= 0; t_s += over_s / 3) {
    pen.moveTo(across(t_s), foot);
    pen.lineTo(across(t_s), foot + 4);
    pen.textAlign = t_s < 0 ? "center" : "right";
    pen.fillText(t_s < 0 ? `${t_s} s` : "now", across(t_s), foot + 6);
  }
  pen.stroke();
}
