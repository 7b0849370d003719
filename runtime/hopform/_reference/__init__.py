"""The reference set: cases of dry friction with exact answers, and the score of a simulator on them."""
