"""BOP datasets, wherever in a folder they lie."""

from app.datasets.formats.registry import ImportFormat
from registration_core.bop.layout import find_root

FORMAT = ImportFormat("bop", lambda _: True, lambda folder, _: find_root(folder))
"""It recognises everything, since it says best what a folder lacks."""
