// Panels at the end of the drawer Watch: what the picture shows; and those of other packages, whose
// HTML the rig sends.

import { on } from "/rig/connection.js";
import { checkbox, make, section } from "/rig/elements.js";
import { layers } from "/rig/camera.js";

const PICTURE = {
  gaze: "where the head looks",
  faces: "faces and what moves, as found",
};

export default {
  drawer: "watch",
  title: "picture",
  build(place) {
    for (const [layer, name] of Object.entries(PICTURE)) {
      const set = (on) => { layers[layer] = on; };
      place.append(checkbox({ name, value: layers[layer] }, set).node);
    }
  },
};

const packages = new Map(); // title -> element

on("panel", ({ title, html }) => {
  if (!packages.has(title)) {
    const { node, body } = section(title, false);
    document.querySelector("#drawer-watch").append(node);
    packages.set(title, body.appendChild(make("div", { className: "html" })));
  }
  packages.get(title).innerHTML = html; // scripts of other addresses, and inline ones, do not run
});
