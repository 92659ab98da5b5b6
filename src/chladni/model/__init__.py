"""The description of a structure: geometry, parts, connections and properties, no matrices."""
