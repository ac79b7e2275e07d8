"""The tables of a report: a table a file, known by lying here."""
