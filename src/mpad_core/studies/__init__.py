"""Questions over several runs."""
