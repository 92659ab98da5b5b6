"""Sparse symmetric factorisation and block Lanczos."""
