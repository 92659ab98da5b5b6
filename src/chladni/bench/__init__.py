"""A virtual test bench: an article, its scatter, sensors and noise; what comes out is a recording."""
