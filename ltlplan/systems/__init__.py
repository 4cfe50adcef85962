"""Systems of robots, step by step: the transition systems and products of the 2022 paper.

Read `transition_systems` (R, E and A = E x R, as values), `robot_systems` (A for the robots of a mission) and `products` (P). `region_graph` gives the
points where robots hover, the regions that can be entered from each, and the actions there. `region_labels` gives the letters along a straight
flight, `visit_words` the word of some visits, `visit_log` the visits of a path. `objective` is what a mission minimises. `flyable_edges`,
`unreachable`, `shared_walls` and `unclear_places` find edges, regions, walls and points that no robot can fly or visit for sure.
`forbidden_regions` are to each leg what obstacles are; `routes` leads legs around these and within rooms, and they touch large regions at `touching_points`. `gaps` bounds ways and their times from below; `due_visits` are those that bounds in seconds ask for. `drawings` shows automata and systems.
"""
