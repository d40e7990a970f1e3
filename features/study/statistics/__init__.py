"""Tests, effect sizes and models for the participants' answers; pure functions, with SciPy."""
