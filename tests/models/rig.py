"""The hopper on a rig: its foot is bolted to the ground, so the leg pulls as well as it pushes, and never takes off."""

fixed = ("foot",)
terms = ()
