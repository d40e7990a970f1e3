"""A detector whose OpenCV uses every processor, by name for a process of its own."""

import os

import cv2

from gazerig.drivers.types import FaceDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams


def on_all_processors(params: FaceDetectorParams) -> FaceDetector:
    """Make a detector, and let OpenCV in its process use every processor."""
    cv2.setNumThreads(os.cpu_count() or 1)
    return face_detector(params)
