"""Recordings of runs: the inputs and decisions of every tick, in one file."""
