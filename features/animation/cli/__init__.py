"""The commands of the feature animation."""
