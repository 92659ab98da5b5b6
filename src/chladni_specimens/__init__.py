"""Generated structures: plates, panels, the open tailgate; their mesher and their joints."""
