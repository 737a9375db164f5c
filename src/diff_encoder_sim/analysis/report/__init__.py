"""report.html: a self-contained page that works offline."""
