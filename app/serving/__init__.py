"""The port, the state folder and the memory of a running server."""
