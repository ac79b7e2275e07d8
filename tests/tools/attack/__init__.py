"""Attacks by kinds on a running server, over the loopback alone: `./scripts/attack`."""
