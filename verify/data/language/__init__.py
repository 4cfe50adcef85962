"""What is asked, as text, and what is shown, as letters.

`formula` reads linear temporal logic (`free`: what the name of that stands for) and `sequence` reads passages through hoops, each
with our own grammar; `word` is what a flight says.
"""
