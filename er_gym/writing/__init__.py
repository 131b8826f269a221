"""Files that are written whole or not at all, and only over what er-gym wrote.

Every file goes through :func:`write_atomic`, or :func:`replaced` for what is too long for the
memory. It is written beside its place and moved there, so neither a full disk nor a kill leaves
half a file or harms the old one. :func:`whole_folder` does the same for a folder. A file that the
user named, or that is derived from such a name, goes through :func:`write_output`, which replaces
nothing that er-gym did not write unless it is told to.

How er-gym knows its own files (:func:`is_ours`): each says so at its beginning.

========================  ======================================================================
JSON, JSON lines (.gz)    the first key is ``"format"``, its value begins with ``er-gym/``
Markdown                  begins with ``<!-- Written by er-gym``
YAML                      begins with ``# Written by er-gym``
PNG                       the text chunk ``Software`` is ``er-gym``
JPEG                      the comment begins with ``Written by er-gym``
========================  ======================================================================

The paper's task files and other kinds of pictures have no place for such a mark. An empty file
counts as er-gym's, since it holds nothing that could be lost.
"""

from er_gym.writing.atomic import (
    CAREFULLY,
    CannotWrite,
    make_folder,
    replaced,
    write_atomic,
    write_new,
)
from er_gym.writing.cache import kept, user_cache
from er_gym.writing.folders import check_folder, whole_folder
from er_gym.writing.names import OutsideFolder, file_stem, inside, place_file, writable
from er_gym.writing.outputs import (
    MARKDOWN_MARK,
    YAML_MARK,
    ForeignFile,
    check_output,
    is_ours,
    write_output,
)
from er_gym.writing.pictures import PICTURE_MARK, picture_format, write_figure, write_picture

__all__ = [
    "CAREFULLY",
    "MARKDOWN_MARK",
    "PICTURE_MARK",
    "YAML_MARK",
    "CannotWrite",
    "ForeignFile",
    "OutsideFolder",
    "check_folder",
    "check_output",
    "file_stem",
    "inside",
    "is_ours",
    "kept",
    "make_folder",
    "picture_format",
    "place_file",
    "replaced",
    "user_cache",
    "whole_folder",
    "writable",
    "write_atomic",
    "write_figure",
    "write_new",
    "write_output",
    "write_picture",
]
