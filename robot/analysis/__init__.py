"""What a run or an eye tracker's recording says about gaze."""
