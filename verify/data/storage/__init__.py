"""Files and folders: read as exactly one thing or refused, written whole or not at all.

`safe_reading`, `strict_yaml` and `tables` are the doors in; `folders` and `single_files` are the doors out, and `ownership` tells
our files from the user's. `file_names` knows which names file systems confuse.
`archives` reads zip files from strangers.
"""
