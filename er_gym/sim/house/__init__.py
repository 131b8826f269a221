"""Houses in ProcTHOR's JSON: read, checked, and made into scenes as the recorded ones are."""
