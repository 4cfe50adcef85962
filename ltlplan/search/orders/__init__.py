"""Plans whose words do not hold in every order of the robots, but under precedences between events.

Read `planning` first, the entry. An *event* is a robot's coming to another letter.
`state_sets` follows all team words that a course of events leaves open, `reading` says how a search looks for a cheapest course
all of whose team words satisfy the formula; `one_after_another` walks a few of these courses for large teams, led by `helped_robots`.
`linearisations` looks for a team word that some precedences leave open and that breaks it, and finds few precedences that leave none
open. `event_names` says which visit an event belongs to. `planned_words` finds precedences for words that are planned already.
"""
