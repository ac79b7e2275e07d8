"""REST routes, a file a resource. They check, call, and say what happened; the work is done elsewhere."""
