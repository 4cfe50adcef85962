"""Plans for formulas of `team: joint` that count robots or name them: who is where, as numbers, and who waits for whom.

Read `planning` first. `counting_propositions` says what a formula sees of the team, `moves` what a robot can do from one rest to the next, and
`symmetry_classes` which robots can do the same. `counter_search` searches over how many robots rest where, `minmax_search` over what each of them pays, with
lower bounds from each conjunct (`conjunct_bound`) and from where the robots are (`landmarks`, `cover_bound`). `concurrent_steps` lets robots fly at the same
time where the formula allows every order, and says who must have arrived before who may set out.
`capacities` bounds the robots in a region, `classes` joins places that are alike, `synchronisation` turns steps into waits, and
`conflicting_conjuncts` explains why there is no plan.
"""
