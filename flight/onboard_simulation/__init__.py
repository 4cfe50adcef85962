"""Simulation of onboard software: laws of controllers and an estimator at the rates of common firmware, and the loop that flies them.

Read `steps`, then `fleet`: vehicles of several kinds with their estimators; `rotor_plant` steps those of one kind. `commanded` lets a
controller that commands from the ground fly in the same loop.
"""
