"""What a run says about gaze, and what people do: measures for the page, summaries and features."""
