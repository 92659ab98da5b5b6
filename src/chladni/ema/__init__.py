"""Experimental modal analysis: recordings, identification, correlation, pre-test planning."""
