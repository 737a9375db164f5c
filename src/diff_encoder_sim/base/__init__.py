"""The foundation of all other packages: poses, stamps, seeds, typed parameters, errors, atomic files."""
