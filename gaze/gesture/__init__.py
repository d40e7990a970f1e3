"""Motion that is added to the gaze: gestures, expressions, levels such as a jaw, and breathing."""
