"""Runs in a world with physics: its people, its rigs, and the pictures of their cameras."""
