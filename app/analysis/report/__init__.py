"""Study reports: numbers, tables, figures and pages."""
