"""Strict reading of YAML into frozen values; with the shipped rigs, profiles and scanpaths."""
