"""Reports on ordinary work, outside studies."""
