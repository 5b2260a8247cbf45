"""`stillroom benchmark`: the paper's results table, of simulated robots whose homes are known."""
