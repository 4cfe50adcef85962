"""The folder of a service's data: what is in it, whose it is, and how it is backed up.

Read `data_folder` (whose it is) and `sqlite_file` (its databases, opened and changed), then `backups`, made behind a `deletion_pause`. `retention` says how long what is kept. `drafts` are texts that are
being written; `database_url` finds the database of jobs where it is elsewhere.
"""
