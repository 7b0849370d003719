"""From the equations of motion to formulas: a function of the program is defined where its steps are."""
