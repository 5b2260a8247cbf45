"""Homes with ground truth and robots that map them: for tests, the demo and the benchmark."""
