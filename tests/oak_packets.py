"""Calibrations and archives of an OAK camera, made of depthai's classes without one."""

import io
import json
import tarfile
from pathlib import Path
from typing import Any

COLOUR_FX = 3080.0  # px of a frame of 3840 x 2160
DISTORTION = (8.1, -61.0, 0.0004, -0.0003, 152.0, 7.95, -60.2, 150.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Of the usual rational model: k1 k2 p1 p2 k3 k4 k5 k6, thin prism and tilt."""


def calibrated(dai: Any, colour: bool = True) -> Any:
    """Return the calibration of an OAK-D: what its memory would hold."""
    handler, socket = dai.CalibrationHandler(), dai.CameraBoardSocket
    handler.setDeviceName("OAK-D")
    handler.setProductName("OAK-D")
    if colour:
        K = [[COLOUR_FX, 0.0, 1915.0], [0.0, COLOUR_FX + 2.0, 1072.0], [0.0, 0.0, 1.0]]
        handler.setCameraIntrinsics(socket.CAM_A, K, 3840, 2160)
        handler.setDistortionCoefficients(socket.CAM_A, list(DISTORTION))
        handler.setFov(socket.CAM_A, 68.8)
        handler.setLensPosition(socket.CAM_A, 130)
    return handler


def face_archive(
    path: Path,
    parser: str = "YuNetParser",
    points: int | None = 5,
    network: str = "dlc",
    outputs: tuple[str, ...] = ("cls", "obj", "bbox", "kps"),
) -> Path:
    """Write an NNArchive of a face network, without weights that would run."""
    names = [f"{kind}_{stride}" for kind in outputs for stride in (8, 16, 32)]
    about = {"n_classes": 1, "classes": ["face"], "iou_threshold": 0.3, "conf_threshold": 0.5}
    head = {"parser": parser, "outputs": [], "metadata": {**about, "n_keypoints": points}}
    grey = {"mean": [0.0, 0.0, 0.0], "scale": [1.0, 1.0, 1.0]}
    shape = {"shape": [1, 3, 256, 320], "layout": "NCHW", "preprocessing": grey}
    inputs = {"name": "input", "dtype": "float32", "input_type": "image", **shape}
    model = {
        "metadata": {"name": "faces", "path": f"faces.{network}"},
        "inputs": [inputs],
        "outputs": [{"name": name, "dtype": "float32"} for name in names],
        "heads": [head],
    }
    files = {"config.json": json.dumps({"config_version": "1.0", "model": model}).encode()}
    files[f"faces.{network}"] = bytes(64)
    with tarfile.open(path, "w:xz") as archive:
        for name, content in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return path
