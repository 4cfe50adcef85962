"""Files read as exactly one thing, or refused.

`safe_reading`, `strict_yaml` and `tables` are the doors in. `file_names` knows which names file systems confuse.
`archives` reads zip files from strangers.
"""
