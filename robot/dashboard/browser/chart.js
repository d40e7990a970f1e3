// @ts-check
// Chart of lines over time on a canvas, in the colours of the style sheet.

const LEFT = 40, RIGHT = 8, TOP = 8, FOOT = 20, HEIGHT = 132;
const TICKS = 4;

/** Round step, 1, 2 or 5 times a power of ten, for a number of steps in a span. */
function step(span) {
  const fine = span / TICKS, ten = 10 ** Math.floor(Math.log10(fine));
  return [1, 2, 5, 10].map((n) => n * ten).find((n) => n >= fine) ?? 10 * ten;
}

/** Smallest and largest value of all lines, with a least distance. */
function range(lines, least) {
  let low = Infinity, high = -Infinity;
  for (const line of lines) {
    for (const value of line) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(low <= high)) return [-least / 2, least / 2];
  const more = Math.max(0, least - (high - low)) / 2 + 0.04 * (high - low);
  return [low - more, high + more];
}

/**
 * Draw a chart and return its description.
 * @param {HTMLCanvasElement} canvas
 * @param {{title: string, unit: string, least: number, lines: [string, string][],
 *          x: number[], y: number[][]}} chart
 */
export function drawChart(canvas, chart) {
  const { x, y, lines } = chart;
  const width = canvas.parentElement?.clientWidth ?? 0, scale = window.devicePixelRatio || 1;
  canvas.style.height = `${HEIGHT}px`;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(HEIGHT * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(HEIGHT * scale);
  }
  const pen = canvas.getContext("2d");
  if (!pen || !width) return chart.title;
  const style = getComputedStyle(canvas);
  const colour = (name) => style.getPropertyValue(`--line-${name}`) || style.color;
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, HEIGHT);
  pen.font = `12px ${style.fontFamily}`;
  if (!x.length) return `${chart.title}: nothing yet`;
  const [low, high] = range(y, chart.least), start = Math.min(x[0], -0.5);
  const across = (value) => LEFT + ((value - start) / -start) * (width - LEFT - RIGHT);
  const up = (value) => HEIGHT - FOOT - ((value - low) / (high - low)) * (HEIGHT - FOOT - TOP);

  pen.fillStyle = style.color;
  pen.strokeStyle = colour("grid");
  pen.lineWidth = 1;
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
    pen.fillText(text, value === 0 ? width - RIGHT : across(value), HEIGHT - FOOT + 5);
  }
  y.forEach((values, i) => {
    const [, kind] = lines[i];
    pen.strokeStyle = colour(kind);
    pen.lineWidth = kind === "measured" || kind === "estimated" ? 2 : 1.5;
    pen.setLineDash(kind === "estimated" ? [6, 4] : []);
    pen.beginPath();
    values.forEach((value, n) => (n ? pen.lineTo(across(x[n]), up(value)) : pen.moveTo(across(x[n]), up(value))));
    pen.stroke();
  });
  pen.setLineDash([]);
  return words(chart);
}

/** Description of a chart for screen readers. */
function words(chart) {
  const said = chart.lines.map(([name], i) => {
    const values = chart.y[i];
    const [least, most] = [Math.min(...values), Math.max(...values)];
    return `${name} now ${values[values.length - 1].toFixed(1)}, from ${least.toFixed(1)} to ${most.toFixed(1)}`;
  });
  return `${chart.title}, last ${Math.round(-chart.x[0])} s, ${chart.unit}: ${said.join("; ")}`;
}
