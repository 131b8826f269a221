"""The command ``er-gym``: one file a command."""
