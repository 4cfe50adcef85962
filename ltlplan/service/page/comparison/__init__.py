"""Results on the page, several at once: studies of a mission, and two results side by side.

Begin with `compare_tab`. `varying` begins a study, `studies` shows them; `comparing` shows two results, their flights as a `flight_pair`.
"""
