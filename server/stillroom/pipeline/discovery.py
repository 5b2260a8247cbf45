"""Discovery (paper, section V): where rooms grew, dividers are estimated in the grown region and new rooms are made."""
