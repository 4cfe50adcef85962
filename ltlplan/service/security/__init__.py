"""Access to the service: who may use it, how much and how often. Every request passes here before anything of it is read.

Read `middleware`, which all requests go through, and `passage`, one request on its way; then `admission` (who is let in), `asker` (who asks), `tokens` and `sessions` (who may ask), `origins`
(from where), `body_limits` (how much, how slowly), `rates` (how often) and `open_requests` (how many, and for how long). `refusals` and `plain_pages` say why not.
`connections` ends those that never say what they want.
"""
