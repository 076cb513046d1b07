"""Results for people: terminal text, pictures and the HTML page.

In: results of every room above. Out: text and files. Question: how is it said?
"""
