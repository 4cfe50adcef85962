"""Views of missions and flights as plain data: `formulas` in words, automata by `drawings`, scenes and replays by `watching`, figures of studies by
`plots`, recordings that were judged by `recorded`.
"""
