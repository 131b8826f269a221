"""What a Unity build says of the rooms, and how far the embedded engine agrees with it."""
