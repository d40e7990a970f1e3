"""Moving things by optical flow."""
