"""Lids: blinks and their statistics, and lids that follow the eyes."""
