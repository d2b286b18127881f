"""Studies: a question asked of many variants of a controller, answered by a table and a sentence."""
