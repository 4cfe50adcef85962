"""Files read as exactly one thing, or refused.

`safe_reading`, `strict_yaml` and `tables` are the doors in. `file_names` knows which names file systems confuse.
`shipped_tables` are folders of numbers with their sources, which come with a package.
`archives` reads zip files from strangers.
"""
