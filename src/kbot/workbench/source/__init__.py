"""The description in the page: its source text, its values, and edits."""
