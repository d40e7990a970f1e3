"""The live page: its views, its controls, and access to it."""
