"""Execution of a study: the process of the head, films, and measures of trials."""
