"""Missions on the page: written with help, kept as drafts, stored with their versions.

Begin with `write`, the tab. `drafted` is what a person writes, `stored` what they find and store, `mission_text` edits one value of a mission file, and `checking` runs in
workers.
"""
