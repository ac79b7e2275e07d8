"""What an export can be given as: a format a file, known by lying here."""
