"""Eye-tracker recordings, fits to them, reaction times, and corrections for multiple tests."""
