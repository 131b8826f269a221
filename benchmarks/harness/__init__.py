"""What the scripts for development share: trying, measuring in turns, tables, files, processes."""
