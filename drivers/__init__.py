"""I/O: servo buses, serial ports, cameras and detectors; imports only vendor packages."""
