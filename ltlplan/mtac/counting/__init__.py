"""Formulas that count robots or name them, by MTAC-E.

Read `tasks`, then `move_sequences` (visits put into the course that counts ask for), `role_assignment` (who takes which part) and `bounds`.
"""
