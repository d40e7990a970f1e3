"""Many simulated runs: parameters varied over a grid or a sample, or fitted to people's gaze."""
