"""Detection in images: faces, people, palms, motion."""
