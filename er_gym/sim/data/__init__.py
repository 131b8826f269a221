"""The packaged scene tables (``scenes/*.npz``) and the script that builds them."""
