// Charts on a canvas, in the colours of the style sheet: strips of intervals.

const RIGHT = 8;
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
