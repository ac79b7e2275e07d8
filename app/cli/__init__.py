"""The commands of `snap6d`."""
