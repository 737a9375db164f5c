"""The command-line tools: arguments in, one call into the core, text out."""
