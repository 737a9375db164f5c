"""The lockstep trial, routes and their drivers, and campaigns of trials."""
