"""What goes wrong with a task file."""

from __future__ import annotations


class TaskFileError(ValueError):
    """A file of tasks cannot be used; the message is one line that names the file and the place."""
