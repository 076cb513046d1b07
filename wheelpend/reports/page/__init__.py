"""The self-contained HTML page: template, style, figures, tables."""
