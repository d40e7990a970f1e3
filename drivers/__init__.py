"""Wires: servo buses, serial ports, cameras and detectors; imports vendor packages only."""
