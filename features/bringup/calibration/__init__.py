"""Calibration of joints, linkages, camera and faces."""
