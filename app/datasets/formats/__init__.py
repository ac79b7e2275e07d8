"""What a dataset may be imported from: a format a file, known by lying here."""
