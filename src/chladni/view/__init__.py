"""Off-screen pictures."""
