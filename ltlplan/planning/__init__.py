"""From a mission to an allocation and its nominal paths: what a planning method is, which there are, the paths along what it returns.

Read `allocation` (the value that every method returns), then `nominal` (its paths, and what is asked next where a way is
blocked). The methods are in `ltlplan.search`, `ltlplan.mtac` and `ltlplan.sharing`; `ltlplan.planner` joins the steps to a plan.
"""
