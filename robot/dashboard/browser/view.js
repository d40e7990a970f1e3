// Cost of the 3-D view without a graphics card: 20 pictures a second, of each only the part that has
// changed, and coarse pixels while much of it changes. At rest there are more pixels than the page
// has, so that edges are smooth. A processor draws a whole picture in 30 ms if it is coarse and in
// 100 ms if it is fine, instead of 2, and the rig needs it, too.

(() => {
  "use strict";

  const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
  const LEAST_MS = 1000 / 20;
  const EARLY_MS = 4; // pictures come at the refresh of the display
  const COARSE = 0.6, FINE = 1.5; // pixels of the canvas, per pixel of the page
  const MUCH = 0.1; // share of the picture
  const REST_MS = 400;

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
    asked.set("fixedDpr", COARSE);
    asked.set("websocket", location.origin.replace(/^http/, "ws") + "/view/");
    history.replaceState(null, "", `${location.pathname}?${asked}`);
  }

  const DRAWING = { antialias: false, preserveDrawingBuffer: true };
  const open = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, how) {
    return open.call(this, kind, kind.startsWith("webgl") ? { ...how, ...DRAWING } : how);
  };

  const soon = window.requestAnimationFrame.bind(window);
  const waiting = new Map();
  let number = 0, due = 0, asleep = true;
  let busyAt = 0; // when much of the picture has changed last
  function draw(now) {
    if (now < due - EARLY_MS) return soon(draw);
    due = Math.max(due + LEAST_MS, now);
    const turns = [...waiting.values()];
    waiting.clear();
    asleep = true;
    drawParts(window.__viserMutable?.scene);
    for (const turn of turns) turn(now);
  }
  window.requestAnimationFrame = (turn) => {
    waiting.set(++number, turn);
    if (asleep) { asleep = false; soon(draw); }
    return number;
  };
  window.cancelAnimationFrame = (one) => { waiting.delete(one); };

  // --- the part that has changed ----------------------------------------------------------

  const WHOLE_MS = 2000; // a change that is not noticed here is drawn by then
  const STILL_PX = 0.5; // of the page; nobody sees a smaller motion, and servos report steps like it
  const EDGE_PX = 3;
  const drawn = new Map(); // object -> how it was drawn: {pose, look, corners, box}
  let camera = "", size = "", wholeAt = 0, hidden = [];

  function drawParts(scene) {
    if (!scene || scene.onBeforeRender === begin) return;
    scene.onBeforeRender = begin;
    scene.onAfterRender = end;
  }

  /** Limit a picture to the part of the canvas in which something has changed. */
  function begin(renderer, scene, eye, target) {
    if (target || eye !== window.__viserMutable.camera) return;
    const ratio = performance.now() - busyAt > REST_MS ? FINE : COARSE;
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio); // empties the canvas
    const { width, height } = renderer.domElement;
    const background = window.__viserMutable.backgroundMaterial; // covers all, mostly with nothing
    if (background) background.visible = background.uniforms.enabled.value;
    const matrices = [...eye.matrixWorld.elements, ...eye.projectionMatrix.elements];
    const turned = matrices.join() !== camera;
    const whole = turned || size !== `${width} x ${height}` || performance.now() - wholeAt > WHOLE_MS;
    const part = [1, 1, -1, -1], changed = [1, 1, -1, -1], now = new Set();
    scene.traverseVisible((object) => {
      if (!object.geometry || object.material?.visible === false) return;
      now.add(object);
      const before = drawn.get(object);
      const look = lookOf(object), pose = object.matrixWorld.elements.join();
      const same = before?.look === look;
      if (same && before.pose === pose && object.frustumCulled && !whole) return;
      const corners = cornersOf(object, eye);
      const still = same && isStill(before.corners, corners, width / ratio, height / ratio);
      if (still && !whole) return;
      const box = boxOf(corners);
      for (const area of still ? [part] : [part, changed]) {
        if (before) widen(area, before.box);
        widen(area, box);
      }
      drawn.set(object, { pose, look, corners, box });
    });
    for (const [object, { box }] of drawn) {
      if (now.has(object)) continue;
      widen(part, box);
      drawn.delete(object);
    }
    if (turned || shareOf(changed) > MUCH) busyAt = performance.now();
    [camera, size] = [matrices.join(), `${width} x ${height}`];
    if (whole) { wholeAt = performance.now(); return; }
    for (const object of now) {
      const [left, low, right, high] = drawn.get(object).box;
      if (left <= part[2] && right >= part[0] && low <= part[3] && high >= part[1]) continue;
      hidden.push([object, object.layers.mask]);
      object.layers.mask = 0;
    }
    const pixel = (share, size, edge) =>
      Math.min(size, Math.max(0, Math.round((share + 1) / 2 * size) + edge)) / ratio;
    const x = pixel(part[0], width, -EDGE_PX), y = pixel(part[1], height, -EDGE_PX);
    const right = pixel(part[2], width, EDGE_PX), high = pixel(part[3], height, EDGE_PX);
    renderer.setScissor(x, y, Math.max(0, right - x), Math.max(0, high - y));
    renderer.setScissorTest(true);
  }

  function end(renderer) {
    renderer.setScissorTest(false);
    for (const [object, mask] of hidden) object.layers.mask = mask;
    hidden = [];
  }

  /** What an object's picture depends on besides its pose. */
  function lookOf({ geometry, material }) {
    const parts = [...Object.values(geometry.attributes), ...[material].flat()];
    return [geometry.uuid, geometry.instanceCount, ...parts.map(
      (part) => [part.version, part.uuid, part.opacity, part.color?.getHex(), part.map?.version],
    )].join();
  }

  /** Corners of an object on the canvas, x and y from -1 to 1; none: not in view; null: anywhere. */
  function cornersOf({ geometry, material, matrixWorld, frustumCulled }, eye) {
    const project = eye.projectionMatrix.elements, found = []; // h and v: -w to w in view
    const m = eye.matrixWorldInverse.clone().premultiply(eye.projectionMatrix);
    if (frustumCulled) m.multiply(matrixWorld);
    const e = m.elements;
    const add = (x, y, z, right = 0, up = 0) => found.push({
      h: e[0] * x + e[4] * y + e[8] * z + e[12] + project[0] * right,
      v: e[1] * x + e[5] * y + e[9] * z + e[13] + project[5] * up,
      w: e[3] * x + e[7] * y + e[11] * z + e[15],
    });
    if (frustumCulled) {
      if (!geometry.boundingBox) geometry.computeBoundingBox();
      const { min, max } = geometry.boundingBox;
      for (const x of [min.x, max.x]) {
        for (const y of [min.y, max.y]) for (const z of [min.z, max.z]) add(x, y, z);
      }
    } else if (geometry.instanceCount > 0) { // labels, where viser's shader draws them
      const { aLabelIndex, aRect, aParams } = geometry.attributes, { uniforms } = material;
      if (!uniforms?.uLabelData || !aRect) return null;
      const places = uniforms.uLabelData.value.image.data;
      const perDepth = 80 * uniforms.uFovScale.value / uniforms.uViewportHeight.value;
      for (let i = 0; i < geometry.instanceCount; i++) {
        const [x, y, z, shown] = places.subarray(4 * aLabelIndex.array[i]);
        const [left, low, wide, tall] = aRect.array.subarray(4 * i);
        const [onScreen, size] = aParams.array.subarray(2 * i);
        const depth = e[3] * x + e[7] * y + e[11] * z + e[15];
        if (depth < eye.near) continue;
        const scale = shown * size * (onScreen ? depth * perDepth : 1);
        add(x, y, z, left * scale, low * scale);
        add(x, y, z, (left + wide) * scale, (low + tall) * scale);
      }
    }
    const near = eye.near, beyond = [
      ({ h, w }) => h < -w, ({ h, w }) => h > w, ({ v, w }) => v < -w, ({ v, w }) => v > w,
      ({ w }) => w < near,
    ];
    if (beyond.some((side) => found.every(side))) return [];
    if (found.some(({ w }) => w < near)) return null;
    return found.flatMap(({ h, v, w }) => [h / w, v / w]);
  }

  function boxOf(corners) {
    const box = [1, 1, -1, -1];
    if (!corners) return [-1, -1, 1, 1];
    for (let i = 0; i < corners.length; i += 2) {
      const corner = corners.slice(i, i + 2);
      widen(box, [...corner, ...corner]);
    }
    return box;
  }

  /** Share of the canvas that a box covers. */
  function shareOf([left, low, right, high]) {
    return left < right && low < high ? (right - left) * (high - low) / 4 : 0;
  }

  function widen(box, [left, low, right, high]) {
    if (left > right) return;
    box[0] = Math.min(box[0], left);
    box[1] = Math.min(box[1], low);
    box[2] = Math.max(box[2], right);
    box[3] = Math.max(box[3], high);
  }

  function isStill(before, now, width, height) {
    return before !== null && now !== null && before.length === now.length && now.every(
      (place, i) => Math.abs(place - before[i]) * (i % 2 ? height : width) / 2 < STILL_PX,
    );
  }
})();
