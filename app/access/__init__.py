"""Who may come in, and how guessing is made slow."""
