"""From detections in camera frames to people and things localised in the world."""
