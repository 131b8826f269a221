"""Runs the blocks of the documentation: see ``__main__``."""
