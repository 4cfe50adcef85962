"""Files and folders written whole or not at all, where nothing of a user's is lost.

`folders` writes folders and `single_files` adds files to them; `ownership` tells our files from the user's.
"""
