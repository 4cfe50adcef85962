"""Names by which objects are found: those that other packages may add, those loaded at first use, and former ones.

Read `registry`, a table of what has a name, and `choices`, the tables of planning methods and cost terms. `loading` loads a package's names
at their first use, and `former_names` keeps renamed ones.
"""
