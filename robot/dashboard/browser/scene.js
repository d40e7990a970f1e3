// Panels at the end of the drawer Watch: what the scene and the picture show, and from where; and
// those of other packages, whose HTML the rig sends.

import { on } from "/rig/connection.js";
import { buttons, checkbox, make, section } from "/rig/elements.js";
import { layers } from "/rig/camera.js";
import { order } from "/rig/orders.js";

const PICTURE = {
  gaze: "picture: where the head looks",
  faces: "picture: faces and what moves, as found",
};
const VIEWS = ["face", "both", "over its shoulder", "from above"];

export default {
  drawer: "watch",
  title: "view",
  build(place) {
    const from = buttons("look from", VIEWS, (look_from) => order({ do: "show_view", look_from }));
    place.append(from.node);
    for (const [layer, name] of Object.entries(PICTURE)) {
      const set = (on) => { layers[layer] = on; };
      place.append(checkbox({ name, value: layers[layer] }, set).node);
    }
    const sight = (on) => order({ do: "show_view", layers: on ? ["sight"] : [] });
    place.append(checkbox({ name: "lines of sight" }, sight).node);
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
