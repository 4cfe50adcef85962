"""Plans for formulas of `team: joint` that count robots or name them: the number of robots in each place, and the waits between them.

Read `stages` first: the two ways that `exact` tries, and the waits of each. `planning` has their searches. `counting_propositions` turns
letters of robots into sums, `moves` lists a robot's moves from one rest to the next, and `symmetry_classes` joins the places of robots that
can do the same into `classes`. `reading` is the team as the shared searches walk it, in courses; lower bounds
are in `ltlplan.search.bounds`. `counted_plans` puts moves into concurrent steps where the formula allows every order (`interleavings`), and `needed_waits` keeps the waits that it needs. `capacities` bounds the robots in a region, and `conflicting_conjuncts` explains why there is no plan.
"""
