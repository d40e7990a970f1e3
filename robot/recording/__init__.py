"""Recordings of runs: every tick with what it knew and decided, in one file."""
