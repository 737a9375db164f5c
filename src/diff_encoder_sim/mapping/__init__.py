"""Occupancy grids and their files, as map_server and map_saver have them."""
