"""The whole dataset in the form of BOP, with its interaction log."""

from app.export.formats.registry import ExportFormat

FORMAT = ExportFormat("bop", "BOP, everything", lambda checked, target: checked.replace(target))
