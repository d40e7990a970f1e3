"""The way browsers come in: who may, how often, and where their connections lead."""
