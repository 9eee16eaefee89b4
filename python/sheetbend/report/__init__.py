"""Reports: tables, the sections of a fit's report, scores, and the result that users hold."""
