"""Systems of robots, step by step: the transition systems and products of the 2022 paper.

Read `transition_systems` (R, E and A = E x R, as values), `robot_systems` (A for the robots of a mission) and `products` (P).
`region_graph` says where robots rest, which region may be entered from where and which actions are permitted there, `region_labels`
which letters a straight flight shows, `visit_words` which word some visits do, `visit_log` which visits a way makes; `drawings` shows automata
and systems.
`objective` says what a mission minimises. `flyable_edges`, `unreachable` and `shared_walls` find edges, regions and walls that no robot can fly. `unclear_places`
says what keeps a region from being visited for sure.
"""
