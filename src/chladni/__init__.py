"""Find where a finite element model and a recording differ, and name the missing physics."""
