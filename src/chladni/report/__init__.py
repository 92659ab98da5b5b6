"""Reports: one self-contained page for each run."""
