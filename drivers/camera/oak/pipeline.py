"""Nodes that run on the camera, and synchronisation of their messages.

Only ``device_nodes`` needs a camera. Any other function with the same outputs can replace it:
depthai's replay and host nodes work without a camera.
"""

from collections.abc import Callable
from datetime import timedelta
from typing import Any, NamedTuple

import numpy as np

from gazerig.drivers.camera.depth_roi import resize_depth, to_metres
from gazerig.drivers.camera.params import OakParams
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import to_bgr
from gazerig.drivers.types import Depth, ImageArray

WIDTH_PX, HEIGHT_PX = 640, 400
"""Size of the frames: a multiple of 16 by 2, and that of the stereo pair."""
COLOUR, DEPTH = "colour", "depth"
"""Names of the messages in a group."""
# Two groups may be queued: the current one and the newest.
_QUEUE = 2


class PipelineOutputs(NamedTuple):
    """Outputs of nodes: frames, and depth in millimetres (RAW16), None without it."""

    colour: Any
    depth: Any | None = None


MakeNodes = Callable[[Any, Any, OakParams], PipelineOutputs]
"""Creates nodes from depthai, a pipeline and the parameters, and returns their outputs."""


def device_nodes(dai: Any, pipeline: Any, params: OakParams) -> PipelineOutputs:
    """Create the nodes on the camera: colour without distortion, and aligned depth."""
    camera = pipeline.create(dai.node.Camera).build(dai.CameraBoardSocket.CAM_A)
    colour = camera.requestOutput(
        (WIDTH_PX, HEIGHT_PX),
        type=dai.ImgFrame.Type.NV12,
        fps=params.rate_hz,
        enableUndistortion=True,
    )
    return PipelineOutputs(colour, _stereo(dai, pipeline, params, colour))


def join_outputs(dai: Any, pipeline: Any, outputs: PipelineOutputs, rate_hz: float) -> Any:
    """Return the queue of message groups, each with all outputs of one instant."""
    sync = pipeline.create(dai.node.Sync)
    sync.setRunOnHost(True)
    sync.setSyncThreshold(timedelta(seconds=0.5 / rate_hz))
    for name, output in zip((COLOUR, DEPTH), outputs, strict=True):
        if output is not None:
            output.link(sync.inputs[name])
    return sync.out.createOutputQueue(maxSize=_QUEUE, blocking=False)


def _stereo(dai: Any, pipeline: Any, params: OakParams, colour: Any) -> Any:
    """Create depth that is aligned with the colour frame pixel by pixel."""
    socket = dai.CameraBoardSocket
    stereo = pipeline.create(dai.node.StereoDepth)
    stereo.setDefaultProfilePreset(dai.node.StereoDepth.PresetMode.ROBOTICS)
    # Distances on which both cameras disagree are discarded.
    stereo.setLeftRightCheck(True)
    # Measures from 35 cm instead of 70 on an OAK-D, and finer beyond 2 m.
    stereo.setExtendedDisparity(True)
    stereo.setSubpixel(True)
    for side, eye in ((socket.CAM_B, stereo.left), (socket.CAM_C, stereo.right)):
        pipeline.create(dai.node.Camera).build(side).requestOutput(
            (WIDTH_PX, HEIGHT_PX), fps=params.rate_hz
        ).link(eye)
    platform = pipeline.getDefaultDevice().getPlatform()
    if platform != dai.Platform.RVC4:
        colour.link(stereo.inputAlignTo)
        return stereo.depth
    # The newer chip aligns depth in a separate node.
    align = pipeline.create(dai.node.ImageAlign)
    stereo.depth.link(align.input)
    colour.link(align.inputAlignTo)
    return align.outputAligned


# A frame without a lens contains the unit matrix.
_LEAST_FOCAL_PX = 10.0


def image_of(group: Any) -> ImageArray | None:
    """Return the colour frame of a group, None if it has none."""
    return to_bgr(group[COLOUR].getCvFrame())


def depth_of(group: Any, width_px: int, height_px: int) -> Depth | None:
    """Return the depth of a group in metres and in the size of its frame."""
    if DEPTH not in group.getMessageNames():
        return None
    mm = np.asarray(group[DEPTH].getFrame())
    if mm.dtype != np.uint16 or mm.ndim != 2 or not mm.size:
        return None
    return resize_depth(to_metres(mm), width_px, height_px)


def lens_of(group: Any) -> Intrinsics | None:
    """Return the lens of the frame, None if it has none."""
    matrix = np.asarray(group[COLOUR].getTransformation().getIntrinsicMatrix(), dtype=float)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or matrix[0, 0] < _LEAST_FOCAL_PX:
        return None
    return Intrinsics(
        float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])
    )
