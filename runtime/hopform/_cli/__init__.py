"""The commands of the core, and what commands are made of. `_front` calls them."""
