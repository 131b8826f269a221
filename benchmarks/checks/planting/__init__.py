"""Parts of planted_faults: the faults, where they are planted, and the tests that reach them."""
