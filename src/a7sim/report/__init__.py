"""What is made of a session's folder afterwards: the report, printed forms, cards, a film of it, comparisons."""
