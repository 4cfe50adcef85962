"""Formulas that count robots or name them, by MTAC-E.

Read `tasks`, then `move_sequences` (visits put into the sequence of moves that counts ask for).
"""
