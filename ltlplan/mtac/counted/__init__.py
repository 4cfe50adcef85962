"""Formulas that count robots or name them, by MTAC-E.

Read `tasks`, then `courses` (visits put into the course that counts ask for), `parts` (who takes which part) and `bounds`.
"""
