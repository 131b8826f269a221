"""Exports: a collection as training files of a library.

Each format is a row of :data:`EXPORTS`; other packages add theirs by an entry point of the group
``er_gym.exports``, or name one as ``package.module:NAME``.
"""

from er_gym.data.exports.base import (
    ExportError,
    ExportFormat,
    ExportJob,
    ExportOptions,
    ExportSummary,
)
from er_gym.data.exports.export import EXPORTS, export

__all__ = [
    "EXPORTS",
    "ExportError",
    "ExportFormat",
    "ExportJob",
    "ExportOptions",
    "ExportSummary",
    "export",
]
