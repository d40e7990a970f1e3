"""Detection of moving things by optical flow."""
