"""The foundation of all other rooms: poses, stamps, seeds, typed parameters, errors, atomic files."""
