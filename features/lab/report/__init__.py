"""A report on how human the gaze was: figures, pass bands and their sources."""
