"""Find where a finite element model and a vibration recording differ, and name the missing physics."""
