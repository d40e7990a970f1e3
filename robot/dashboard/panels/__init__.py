"""Panels of the page: charts, figures, controls, health."""
