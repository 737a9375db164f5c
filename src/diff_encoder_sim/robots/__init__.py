"""Robots: their descriptions read, found out about, and made right for the physics."""
