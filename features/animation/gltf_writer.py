"""A motion of the rig's joints as an animation in its glTF model."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from gazerig.features.animation.glb import split_glb
from gazerig.features.animation.gltf_reader import rest_quaternion
from gazerig.gaze.types import Floats
from gazerig.robot.description.glb_file import join_glb
from gazerig.robot.description.gltf import gltf
from gazerig.robot.description.links import Description, Link

_FLOAT = 5126


def animated_gltf(
    description: Description, name: str, times_s: Floats, angles_rad: Mapping[str, Floats]
) -> bytes:
    """Return the rig's glTF model with one animation.

    Args:
        description: description of the rig.
        name: name of the animation.
        times_s: (n,) increasing times.
        angles_rad: (n,) angles by joint.
    """
    text, binary = split_glb(Path(name), gltf(description))
    tree: dict[str, Any] = msgspec.json.decode(text)
    parts = [binary]

    def add(values: Floats, kind: str) -> int:
        """Append numbers to the buffer; return their accessor."""
        data = values.astype("<f4").tobytes()
        view = {"buffer": 0, "byteOffset": sum(map(len, parts)), "byteLength": len(data)}
        parts.append(data)
        tree["bufferViews"].append(view)
        accessor = {
            "bufferView": len(tree["bufferViews"]) - 1,
            "componentType": _FLOAT,
            "count": len(values),
            "type": kind,
        }
        if kind == "SCALAR":
            accessor |= {"min": [float(values[0])], "max": [float(values[-1])]}
        tree["accessors"].append(accessor)
        return len(tree["accessors"]) - 1

    # As the file has them, in single precision.
    clock = add(times_s.astype(np.float32), "SCALAR")
    nodes = {
        node["extras"]["joint"]: i
        for i, node in enumerate(tree["nodes"])
        if "joint" in node.get("extras", {})
    }
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    for link in description.links:
        joint = link.joint
        if joint is None:
            continue
        leader, ratio = (joint.follows or (joint.name, 1.0))[:2]
        if leader in angles_rad:
            rotations = add(node_rotations(link, ratio * angles_rad[leader]), "VEC4")
            target = {"node": nodes[joint.name], "path": "rotation"}
            channels.append({"sampler": len(samplers), "target": target})
            samplers.append({"input": clock, "output": rotations, "interpolation": "LINEAR"})
    tree["animations"] = [{"name": name, "channels": channels, "samplers": samplers}]
    tree["buffers"][0]["byteLength"] = sum(map(len, parts))
    return join_glb(msgspec.json.encode(tree), b"".join(parts))


def node_rotations(link: Link, angles_rad: Floats) -> Floats:
    """Return the (n, 4) rotations x, y, z, w of a joint's node."""
    assert link.joint is not None
    w0, *v = rest_quaternion(link).tolist()
    axis, half = np.array(link.joint.axis), 0.5 * angles_rad[:, None]
    s, c = np.sin(half) * axis, np.cos(half)
    xyz = w0 * s + c * np.array(v) + np.cross(v, s)
    return np.concatenate((xyz, w0 * c - s @ np.array(v)[:, None]), axis=1)
