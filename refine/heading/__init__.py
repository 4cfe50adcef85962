"""Heading of a vehicle along its path.

`yaw` fits headings that a plan asks for; `spin` chooses one that turns as little as possible where flights tumble. Both fit by
`least_squares`.
"""
