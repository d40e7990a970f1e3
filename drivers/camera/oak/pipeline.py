"""Nodes that run on the camera, and synchronisation of their messages.

Only ``device_nodes`` needs a camera. Any other function with the same outputs can replace it:
depthai's replay and host nodes work without a camera.
"""

from collections.abc import Callable
from datetime import timedelta
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from gazerig.drivers.camera.depth_roi import resize_depth, to_metres
from gazerig.drivers.camera.oak.face_archive import kind_of, read_archive
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.yunet_decoder import FoundFaces, yunet_faces
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import to_bgr
from gazerig.drivers.types import Depth, DetectedFace, ImageArray

_ANTI_FLICKER = {"off": "OFF", "50hz": "MAINS_50_HZ", "60hz": "MAINS_60_HZ", "auto": "AUTO"}


def set_controls(dai: Any, control: Any, params: OakParams) -> None:
    """Set exposure limit, anti-flicker and focus in a CameraControl.

    Settings that the rig leaves open stay at the camera's defaults.
    """
    if params.exposure_limit_ms is not None:
        control.setAutoExposureLimit(round(params.exposure_limit_ms * 1e3))
    if params.anti_flicker != "default":
        modes = dai.CameraControl.AntiBandingMode
        control.setAntiBandingMode(getattr(modes, _ANTI_FLICKER[params.anti_flicker]))
    if params.focus is not None:
        control.setManualFocus(params.focus)


COLOUR, DEPTH, FACES = "colour", "depth", "faces"
"""Names of the messages in a group."""
# Two groups may be queued: the current one and the newest.
_QUEUE = 2


class PipelineOutputs(NamedTuple):
    """Outputs of nodes: frames, depth in millimetres (RAW16), and faces.

    depth, faces: None if they are not wanted
    face_fault: returns why no faces can be found on the camera, "" if they can
    """

    colour: Any
    depth: Any | None = None
    faces: Any | None = None
    face_fault: Callable[[], str] = str


MakeNodes = Callable[[Any, Any, OakParams], PipelineOutputs]
"""Creates nodes from depthai, a pipeline and the parameters, and returns their outputs."""


def device_nodes(dai: Any, pipeline: Any, params: OakParams) -> PipelineOutputs:
    """Create the nodes on the camera: colour without distortion, aligned depth, faces.

    Raises:
        CameraError: the face model cannot be read.
    """
    socket = dai.CameraBoardSocket
    camera = pipeline.create(dai.node.Camera).build(socket.CAM_A)
    set_controls(dai, camera.initialControl, params)
    size = params.width_px, params.height_px
    colour = camera.requestOutput(
        size,
        type=dai.ImgFrame.Type.NV12,
        fps=params.rate_hz,
        enableUndistortion=params.undistort,
    )
    outputs = PipelineOutputs(
        colour,
        _stereo(dai, pipeline, params, colour) if params.depth else None,
    )
    if not params.face_model:
        return outputs
    # A YuNet is decoded on the host.
    archive = read_archive(dai, params.face_model)
    platform = pipeline.getDefaultDevice().getPlatform()
    if kind_of(archive, platform, params.face_model) == "yunet":
        network = pipeline.create(dai.node.NeuralNetwork)
        # Letterboxed: if cropped to the network's shape, the sides would not be searched.
        whole = dai.ImgResizeMode.LETTERBOX
        network = network.build(camera, archive, fps=params.rate_hz, resizeMode=whole)
        size = archive.getInputSize()
        found = yunet_faces(dai, pipeline, network.out, size, params.min_confidence)
    else:
        network = pipeline.create(dai.node.DetectionNetwork)
        network = network.build(camera, archive, fps=params.rate_hz)
        network.setConfidenceThreshold(params.min_confidence)
        found = FoundFaces(network.out)
    return outputs._replace(faces=found.output, face_fault=found.fault)


def join_outputs(dai: Any, pipeline: Any, outputs: PipelineOutputs, rate_hz: float) -> Any:
    """Return the queue of message groups, each with all outputs of one instant."""
    sync = pipeline.create(dai.node.Sync)
    sync.setRunOnHost(True)
    sync.setSyncThreshold(timedelta(seconds=0.5 / rate_hz))
    for name, output in zip((COLOUR, DEPTH, FACES), outputs[:3], strict=True):
        if output is not None:
            output.link(sync.inputs[name])
    return sync.out.createOutputQueue(maxSize=_QUEUE, blocking=False)


def _stereo(dai: Any, pipeline: Any, params: OakParams, colour: Any) -> Any:
    """Create depth that is aligned with the colour frame pixel by pixel."""
    socket = dai.CameraBoardSocket
    stereo = pipeline.create(dai.node.StereoDepth)
    preset = getattr(dai.node.StereoDepth.PresetMode, params.stereo_preset.upper())
    stereo.setDefaultProfilePreset(preset)
    stereo.setLeftRightCheck(params.left_right_check)
    stereo.setExtendedDisparity(params.extended_disparity)
    stereo.setSubpixel(params.subpixel)
    for side, eye in ((socket.CAM_B, stereo.left), (socket.CAM_C, stereo.right)):
        pipeline.create(dai.node.Camera).build(side).requestOutput(
            (640, 400), fps=params.rate_hz
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


_LANDMARKS = 5
# A frame without a lens contains the unit matrix.
_LEAST_FOCAL_PX = 10.0


def message_names(group: Any) -> set[str]:
    """Return the names of the messages in a group."""
    return set(group.getMessageNames())


def image_of(group: Any) -> ImageArray | None:
    """Return the colour frame of a group, None if it has none."""
    return to_bgr(group[COLOUR].getCvFrame())


def depth_of(group: Any, width_px: int, height_px: int) -> Depth | None:
    """Return the depth of a group in metres and in the size of its frame."""
    if DEPTH not in message_names(group):
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


def faces_of(
    group: Any, width_px: int, height_px: int, min_confidence: float
) -> tuple[DetectedFace, ...] | None:
    """Return the faces that the camera found, the largest first; None if it did not search.

    Detections without five landmarks are omitted, as their gaze is unknown.
    """
    if FACES not in message_names(group):
        return None
    message = group[FACES]
    target = group[COLOUR].getTransformation()
    if message.getTransformation() is not None and target is not None:
        message = message.transformTo(target)
    found = [_face(detection, width_px, height_px) for detection in message.detections]
    sure = [face for face in found if face is not None and face.confidence >= min_confidence]
    return tuple(sorted(sure, key=lambda face: -face.box_px[2] * face.box_px[3]))


def _face(detection: Any, width_px: int, height_px: int) -> DetectedFace | None:
    """Convert a detection from shares of the frame to pixels."""
    points = np.array([[p.x, p.y] for p in detection.getKeypoints2f()], dtype=np.float64)
    edges = (detection.xmin, detection.ymin, detection.xmax, detection.ymax)
    if points.shape != (_LANDMARKS, 2) or not all(map(isfinite, (*edges, *points.ravel()))):
        return None
    # Pixels have their centres at whole numbers; the frame begins half a pixel before 0.
    landmarks = points * (width_px, height_px) - 0.5
    left, top, right, bottom = edges
    box = (
        left * width_px - 0.5,
        top * height_px - 0.5,
        (right - left) * width_px,
        (bottom - top) * height_px,
    )
    landmarks.setflags(write=False)
    return DetectedFace(box, landmarks, min(1.0, max(0.0, float(detection.confidence))))
