"""stillroom keeps a home's rooms still while the robot's map under them moves."""

__version__ = "0.1.0"
