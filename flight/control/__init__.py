"""Controllers: from a reference and a belief to commands.

`flatness` turns the reference into thrust, attitude and rates; `controllers` follows it.
"""
