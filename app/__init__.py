"""The web application around `registration_core`: labelling, its log, datasets and their export."""

from importlib.metadata import version

__version__ = version("snap6d")
