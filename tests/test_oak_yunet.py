"""YuNet on the camera: decoded as OpenCV does, and through depthai's host nodes."""

import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from fakes.films import write_film
from present import present

from gazerig.drivers.camera.oak.discovery import load_depthai
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.pipeline import PipelineOutputs
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.oak.yunet_decoder import STRIDES, UnreadableOutputs, decode, yunet_faces

SHARED = Path(__file__).parents[1] / "../shared"
MODEL = SHARED / "models/face_detection_yunet_2026may.onnx"
WIDTH, HEIGHT = 320, 256
FACES = (
    # left, top, width, height, score
    (40.0, 60.0, 52.0, 66.0, 0.95),
    (200.0, 100.0, 22.0, 28.0, 0.7),
)


def points_of(face):
    """Return five points in a face: eyes, nose, corners of the mouth."""
    x, y, w, h, _ = face
    shares = ((0.3, 0.4), (0.7, 0.38), (0.52, 0.6), (0.35, 0.8), (0.66, 0.79))
    return np.array([(x + a * w, y + b * h) for a, b in shares])


def later(faces=FACES, size=(WIDTH, HEIGHT)):
    """Return the outputs of a later YuNet that show these faces, each in two cells."""
    found = {}
    for stride in STRIDES:
        columns, lines = size[0] // stride, size[1] // stride
        widths = {"cls": 1, "obj": 1, "bbox": 4, "kps": 10}
        for kind, width in widths.items():
            found[f"{kind}_{stride}"] = np.zeros((1, columns * lines, width), np.float32)
    for face in faces:
        x, y, w, h, score = face
        stride = 16 if w > 40 else 8
        for beside in (0, 1):
            column, line = int((x + w / 2) / stride) + beside, int((y + h / 2) / stride)
            at = line * (size[0] // stride) + column
            found[f"cls_{stride}"][0, at] = score - 0.1 * beside
            found[f"obj_{stride}"][0, at] = score - 0.1 * beside
            centre = (x + w / 2) / stride - column, (y + h / 2) / stride - line
            found[f"bbox_{stride}"][0, at] = (*centre, np.log(w / stride), np.log(h / stride))
            found[f"kps_{stride}"][0, at] = (points_of(face) / stride - (column, line)).ravel()
    return found


def earlier(faces=FACES, size=(WIDTH, HEIGHT)):
    """Return the outputs of an earlier YuNet that show these faces."""
    boxes, lines, columns = [], size[1] // 8, size[0] // 8
    for stride, sizes in ((8, (10, 16, 24)), (16, (32, 48)), (32, (64, 96)), (64, (128, 192, 256))):
        for line in range(lines):
            for column in range(columns):
                for side in sizes:
                    boxes.append(((column + 0.5) * stride, (line + 0.5) * stride, side))
        lines, columns = lines // 2, columns // 2
    table = np.array(boxes)
    loc, conf, iou = (np.zeros((len(table), n), np.float32) for n in (14, 2, 1))
    for face in faces:
        x, y, w, h, score = face
        middle = x + w / 2, y + h / 2
        far = np.hypot(*(table[:, :2] - middle).T) + np.abs(table[:, 2] - w)
        at = int(np.argmin(far))
        cx, cy, side = table[at]
        conf[at], iou[at] = (1 - score, score), score
        loc[at, :2] = (middle[0] - cx) / side / 0.1, (middle[1] - cy) / side / 0.1
        loc[at, 2:4] = np.log(np.array((w, h)) / side) / 0.2
        loc[at, 4:] = ((points_of(face) - (cx, cy)) / side / 0.1).ravel()
    return {"loc": loc, "conf": conf, "iou": iou}


@pytest.mark.parametrize("made", [later, earlier])
def test_faces_come_back_once_each_the_surest_first(made):
    found = decode(made(), WIDTH, HEIGHT, 0.5)
    assert found.scores == pytest.approx([0.95, 0.7], abs=1e-6)
    for box, points, face in zip(found.boxes, found.points, FACES, strict=True):
        x, y, w, h, _ = face
        expected = np.array((x, y, x + w, y + h)) / np.tile((WIDTH, HEIGHT), 2)
        assert box == pytest.approx(expected, abs=1e-5)
        assert points == pytest.approx(points_of(face) / (WIDTH, HEIGHT), abs=1e-5)


@pytest.mark.parametrize("made", [later, earlier])
def test_unsure_faces_and_numbers_that_are_none_are_left_out(made):
    assert len(decode(made(), WIDTH, HEIGHT, 0.8).scores) == 1
    assert len(decode(made(()), WIDTH, HEIGHT, 0.5).scores) == 0
    outputs = made()
    name = "bbox_16" if made is later else "loc"
    outputs[name] = np.where(outputs[name] != 0.0, np.nan, 0.0).astype(np.float32)
    found = decode(outputs, WIDTH, HEIGHT, 0.5)
    assert np.isfinite(found.boxes).all() and len(found.scores) == (1 if made is later else 0)


def test_outputs_of_another_network_are_named():
    with pytest.raises(UnreadableOutputs, match="has no outputs cls_8, cls_16"):
        decode({"output1": np.zeros((1, 10), np.float32)}, WIDTH, HEIGHT, 0.5)
    with pytest.raises(UnreadableOutputs, match=r"cls_8 has the shape \(1, 1280, 1\), wanted 1200"):
        decode(later(), 320, 240, 0.5)


@pytest.mark.skipif(not MODEL.is_file(), reason=f"no {MODEL}: a user's own file")
@pytest.mark.parametrize("size", [(320, 320), (320, 256), (640, 384)])
def test_real_network_is_decoded_as_opencv_does(size):
    image = cv2.resize(present(cv2.imread(str(SHARED / "media/astronaut.png"))), size)
    network = cv2.dnn.readNetFromONNX(str(MODEL))
    names = network.getUnconnectedOutLayersNames()
    network.setInput(cv2.dnn.blobFromImage(image))
    values = [np.asarray(one, np.float32) for one in network.forward(names)]
    found = decode(dict(zip(names, values, strict=True)), size[0], size[1], 0.5)
    (row,) = cv2.FaceDetectorYN.create(str(MODEL), "", size, 0.5, 0.3).detect(image)[1]
    assert (found.points[0] * size).ravel() == pytest.approx(row[4:14], abs=1e-3)
    assert found.scores[0] == pytest.approx(row[14], abs=1e-5)
    corners = found.boxes[0] * np.tile(size, 2)
    assert corners[:2] == pytest.approx(row[:2], abs=1e-3)
    assert corners[2:] - corners[:2] == pytest.approx(row[2:4], abs=1e-3)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("yunet") / "film.mp4"
    return write_film(path, size=(640, 400), fourcc="mp4v")


def nodes_of(film, outputs):
    """Make a substitute for device_nodes: a film, and a network that gives the same for each."""

    def nodes(dai, pipeline, params) -> PipelineOutputs:
        replay = pipeline.create(dai.node.ReplayVideo)
        replay.setReplayVideoFile(film)
        replay.setOutFrameType(dai.ImgFrame.Type.NV12)
        replay.setFps(params.rate_hz)
        replay.setLoop(True)

        class Network(dai.node.ThreadedHostNode):
            """Gives recorded outputs of a frame that was fitted into 320 x 256 in whole."""

            def __init__(self) -> None:
                super().__init__()
                self.input = self.createInput()
                self.out = self.createOutput()

            def run(self) -> None:
                while self.isRunning():
                    frame, data = self.input.get(), dai.NNData()
                    for name, values in outputs.items():
                        data.addTensor(name, values)
                    place = dai.ImgTransformation(640, 400)
                    place.addScale(0.5, 0.5)  # 320 x 200
                    place.addPadding(28, 28, 0, 0)
                    data.setTransformation(place)
                    data.setTimestamp(frame.getTimestamp())
                    data.setTimestampDevice(frame.getTimestampDevice())
                    data.setSequenceNum(frame.getSequenceNum())
                    self.out.send(data)

        network = pipeline.create(Network)
        replay.out.link(network.input)
        found = yunet_faces(dai, pipeline, network.out, (WIDTH, HEIGHT), params.min_confidence)
        return PipelineOutputs(replay.out, faces=found.output, face_fault=found.fault)

    return nodes


def shots(film, outputs, count):
    params = OakParams(rate_hz=60.0, min_confidence=0.5, face_model="faces.tar.xz")
    source = OakSource(params, nodes_of(film, outputs), on_device=False)
    source.open()
    found = [source.take(time.monotonic, threading.Event()) for _ in range(count)]
    told = source.events()
    source.close()
    return found, told


@pytest.mark.parametrize("made", [later, earlier])
def test_e96_faces_of_the_network_are_in_pixels_of_the_frame(film, made):
    load_depthai()
    found, told = shots(film, made(), 3)
    assert told == ()
    for shot in found:
        assert len(shot.faces) == 2
        for seen, face in zip(shot.faces, FACES, strict=True):
            expected = (points_of(face) - (0.0, 28.0)) * 2.0 - 0.5
            assert seen.landmarks_px == pytest.approx(expected, abs=0.1)
            x, y, w, h, score = face
            box = 2.0 * x - 0.5, 2.0 * (y - 28.0) - 0.5, 2.0 * w, 2.0 * h
            assert seen.box_px == pytest.approx(box, abs=0.1)
            assert seen.confidence == pytest.approx(score, abs=1e-3)


def test_outputs_that_cannot_be_read_are_told_once_and_frames_go_on(film):
    wrong = later()
    del wrong["kps_16"]
    found, told = shots(film, wrong, 20)
    assert len(found) == 20 and found[-1].faces is None
    (line,) = told
    assert "it has no outputs kps_16" in line and "found on the host" in line
