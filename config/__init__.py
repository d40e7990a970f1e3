"""YAML to frozen values, strictly; the shipped rigs, profiles and scanpaths lie beside it."""
