"""What the structure is: geometry, parts, connections, properties; knows nothing of matrices."""
