"""Accounts of people: how they get in, and what they have."""
