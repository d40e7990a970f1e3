"""The commands below ``gazerig study``."""
