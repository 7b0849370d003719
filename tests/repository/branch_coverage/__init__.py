"""Which branches of the generated C the tests take."""
