"""Runs in a world with physics: who is in it, the rigs among them, and what their cameras see."""
