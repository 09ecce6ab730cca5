"""Planning: what is to be made becomes routing problems, and their solutions become a `Toolpath`."""
