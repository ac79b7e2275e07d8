"""BOP datasets, read, checked and written: the only place with millimetres."""
