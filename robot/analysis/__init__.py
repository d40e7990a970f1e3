"""Measures of gaze in a run, and of people: for the page, summaries and features."""
