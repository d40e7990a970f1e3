"""The commands report, sweep and fit-scanpath."""
