"""Sound: playback in a process of its own, and speech programs."""
