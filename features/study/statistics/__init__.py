"""Tests, effect sizes and models for what participants answered; pure, by SciPy."""
