"""The nodes that run on the camera, and how their messages are brought together.

``device_nodes`` is all that needs a camera. Any other function that gives the same outputs
serves as well: depthai's replay and host nodes do, without a camera.
"""

from collections.abc import Callable
from datetime import timedelta
from typing import Any, NamedTuple

from gazerig.drivers.camera.oak.controls import set_controls
from gazerig.drivers.camera.oak.face_archive import kind_of, read_archive
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.yunet_node import FoundFaces, yunet_faces

COLOUR, DEPTH, FACES = "colour", "depth", "faces"
"""Names of the messages in a group."""
# Two groups may wait: one that is read and the newest.
_QUEUE = 2
_GYRO_HZ, _GYRO_BATCH = 200, 2
_READINGS = 100  # messages that may wait: a second


class Outputs(NamedTuple):
    """Outputs of nodes: frames, depth in millimetres (RAW16), found faces, and the gyro's readings.

    depth, faces and imu are None where they are not wanted
    face_fault: returns why no faces can be found there, "" while they can
    """

    colour: Any
    depth: Any | None = None
    faces: Any | None = None
    imu: Any | None = None
    face_fault: Callable[[], str] = str


MakeNodes = Callable[[Any, Any, OakParams], Outputs]
"""Takes depthai, a pipeline and the parameters; return the outputs of the nodes it made."""


def device_nodes(dai: Any, pipeline: Any, params: OakParams) -> Outputs:
    """Make the nodes on the camera: colour without distortion, aligned depth, faces.

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
    outputs = Outputs(
        colour,
        _stereo(dai, pipeline, params, colour) if params.depth else None,
        imu=_imu(dai, pipeline) if params.gyro else None,
    )
    if not params.face_model:
        return outputs
    found = _faces(dai, pipeline, params, camera)
    return outputs._replace(faces=found.out, face_fault=found.fault)


def _imu(dai: Any, pipeline: Any) -> Any:
    """Make the gyro's readings."""
    imu = pipeline.create(dai.node.IMU)
    imu.enableIMUSensor(dai.IMUSensor.GYROSCOPE_RAW, _GYRO_HZ)
    imu.setBatchReportThreshold(_GYRO_BATCH)
    imu.setMaxBatchReports(10 * _GYRO_BATCH)
    return imu.out


def _faces(dai: Any, pipeline: Any, params: OakParams, camera: Any) -> FoundFaces:
    """Make the network that finds faces on the camera; a YuNet is decoded on the host."""
    archive = read_archive(dai, params.face_model)
    platform = pipeline.getDefaultDevice().getPlatform()
    if kind_of(archive, platform, params.face_model) == "yunet":
        network = pipeline.create(dai.node.NeuralNetwork)
        # Fitted in whole: cut to the network's shape, the sides would not be looked at.
        whole = dai.ImgResizeMode.LETTERBOX
        network = network.build(camera, archive, fps=params.rate_hz, resizeMode=whole)
        size = archive.getInputSize()
        return yunet_faces(dai, pipeline, network.out, size, params.min_confidence)
    network = pipeline.create(dai.node.DetectionNetwork)
    network = network.build(camera, archive, fps=params.rate_hz)
    network.setConfidenceThreshold(params.min_confidence)
    return FoundFaces(network.out)


def joined(dai: Any, pipeline: Any, outputs: Outputs, rate_hz: float) -> Any:
    """Return the queue of message groups, each with all outputs of one instant."""
    sync = pipeline.create(dai.node.Sync)
    sync.setRunOnHost(True)
    sync.setSyncThreshold(timedelta(seconds=0.5 / rate_hz))
    for name, output in zip((COLOUR, DEPTH, FACES), outputs[:3], strict=True):
        if output is not None:
            output.link(sync.inputs[name])
    return sync.out.createOutputQueue(maxSize=_QUEUE, blocking=False)


def readings(outputs: Outputs) -> Any | None:
    """Return the queue of the gyro's readings, None where there is none.

    They are not joined to frames: there are many of them to each, in messages of their own.
    """
    if outputs.imu is None:
        return None
    return outputs.imu.createOutputQueue(maxSize=_READINGS, blocking=False)


def _stereo(dai: Any, pipeline: Any, params: OakParams, colour: Any) -> Any:
    """Make depth that lies on the colour frame pixel by pixel."""
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
    # The newer chip aligns in a node of its own.
    align = pipeline.create(dai.node.ImageAlign)
    stereo.depth.link(align.input)
    colour.link(align.inputAlignTo)
    return align.outputAligned
