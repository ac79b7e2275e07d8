"""What the machine is asked for, and what becomes of its estimates."""
