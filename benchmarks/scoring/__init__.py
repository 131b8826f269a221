"""Score episodes and report: metrics, tables, charts."""
