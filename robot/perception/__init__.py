"""Localisation and tracking of people and things in the world, from detections in camera frames."""
