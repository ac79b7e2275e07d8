"""What the logs of registrations tell."""
