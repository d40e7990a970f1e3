"""Many simulated runs: their points, on one machine or several, as a table."""
