"""Who may ask the service, how much and how often; every request passes here before anything of it is read.

Read `gate`, which all requests go through, then `tokens` (who may ask), `origins` (from where), `bodies` (how much, how slowly), `rates`
(how often) and `requests_log` (what is noted of it). `connections` ends those that never say what they want.
"""
