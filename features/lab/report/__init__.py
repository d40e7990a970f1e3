"""Report on the human likeness of the gaze: figures, pass bands and their sources."""
