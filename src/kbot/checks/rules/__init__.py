"""The rules: one function for each rule, one file for each family, imported by `registry` on first use."""
