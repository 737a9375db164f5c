"""Maps of the surroundings: occupancy grids, their files, and how they are made."""
