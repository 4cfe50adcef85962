"""One robot's way past everything that it must keep clear of, as a corridor and the path that keeps it.

Read `corridor` (points to go through, and what each leg must stay out of), `planned`, which makes it from a plan, and `legs`; then
`fitting`, which bends the path with separating planes, and `detours` and `ways_around`, which lead around what bending cannot.
`points` puts points in or leaves some out; `approach`, `relocation`, `meeting_places`, `outside`, `leg_limits` and `sampled_stays` are what particular places
ask for.
`packing` places several robots beside each other, and `place_exchange` exchanges their places; `passage_room` tells how far from a hoop's axis a passage may be.
"""
