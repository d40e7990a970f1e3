// Charts on a canvas, in the colours of the style sheet.

const FONT_PX = 13;

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
