"""The decision of a diagnosis: rows of numbers in, a verdict with its reasons out; no fits."""
