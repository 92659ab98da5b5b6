"""Time data in: WAV, MAT, CSV, NPZ, and how their channels are put together."""
