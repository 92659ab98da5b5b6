"""Input files of Abaqus and CalculiX."""
