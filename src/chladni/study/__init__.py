"""Parameter-study batches."""
