"""The live page: what is shown, what can be done there, and the door to it."""
