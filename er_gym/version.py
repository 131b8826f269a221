"""The version of er-gym, for modules of every layer."""

__version__ = "0.1.0"
