"""Trains, exports and measures the network that finds joints in a person's depth crop."""
