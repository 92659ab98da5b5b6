"""Universal files in and out."""
