"""What chladni can do, one function each: from a case to a result."""
