"""What goes out: the registrations that are exported, and what is seen of their objects."""
