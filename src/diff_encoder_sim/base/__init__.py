"""What every room stands on: poses, stamps, seeds, typed parameters, errors, files that are whole or absent."""
