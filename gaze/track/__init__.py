"""Motion that is added to the gaze: tracks, expressions, levels such as a jaw, and breathing."""
