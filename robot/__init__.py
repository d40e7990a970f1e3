"""The machine: the only place where gaze models and drivers meet."""
