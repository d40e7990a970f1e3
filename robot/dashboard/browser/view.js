// Cost of the 3-D view without a graphics card: coarser pixels without smoothed edges, 20 pictures a
// second. A processor draws a picture in 50 to 200 ms instead of 2, and the rig needs it, too.

(() => {
  "use strict";

  const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
  const LEAST_MS = 1000 / 20;
  const EARLY_MS = 4; // pictures come at the refresh of the display
  const PIXELS = "0.6"; // of the canvas, per pixel of the page

  function drawsInSoftware() {
    const gl = document.createElement("canvas").getContext("webgl2");
    if (!gl) return true;
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    const name = gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
    gl.getExtension("WEBGL_lose_context")?.loseContext();
    return SOFTWARE.test(String(name));
  }

  if (!drawsInSoftware()) return;

  // Viser reads both from its address.
  const asked = new URLSearchParams(location.search);
  if (!asked.has("fixedDpr")) {
    asked.set("fixedDpr", PIXELS);
    asked.set("websocket", location.origin.replace(/^http/, "ws") + "/view/");
    history.replaceState(null, "", `${location.pathname}?${asked}`);
  }

  const open = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, how) {
    return open.call(this, kind, kind.startsWith("webgl") ? { ...how, antialias: false } : how);
  };

  const soon = window.requestAnimationFrame.bind(window);
  const waiting = new Map();
  let number = 0, due = 0, asleep = true;
  function draw(now) {
    if (now < due - EARLY_MS) return soon(draw);
    due = Math.max(due + LEAST_MS, now);
    const turns = [...waiting.values()];
    waiting.clear();
    asleep = true;
    for (const turn of turns) turn(now);
  }
  window.requestAnimationFrame = (turn) => {
    waiting.set(++number, turn);
    if (asleep) { asleep = false; soon(draw); }
    return number;
  };
  window.cancelAnimationFrame = (one) => { waiting.delete(one); };
})();
