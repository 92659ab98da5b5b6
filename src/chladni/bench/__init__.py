"""A virtual test bench: an article, its scatter, sensors and noise; out comes a recording."""
