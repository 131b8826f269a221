"""Files with which other programs make a run: data, arguments, launch script, README.

Each program is a row of :data:`PROGRAMS`; :func:`write_files` writes all that it needs.
"""

from agents.finetune.launchers.write import PROGRAMS, write_files

__all__ = ["PROGRAMS", "write_files"]
