"""One robot's way past everything that it must keep clear of, as a course and the path that keeps it.

Read `course` (points to go through, and what each leg must stay out of), `legs` and `bodies`; then `fitting`, which bends the
path with separating planes, and `detours` and `roadmap`, which lead around what bending cannot. `approach`, `relocation`,
`leg_limits` and `sampled_stays` are what particular places ask for.
"""
