"""Skybrush shows: archives, drones, and what a show asks of itself.

Read `skybrush_shows` over `show_archives`, then `show_settings` and `own_limits` (validation settings), `fences` and `fence_claims` (polygons).
`take_offs` reads how drones leave their homes and land.
"""
