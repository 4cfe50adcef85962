"""The page of an audit, and its pictures.

`audit_page` is the page; `audit_pictures` draws the tightest instants.
"""
