"""What comes from outside: bits into the C library (`make fuzz`), objects, command lines and files into the rest."""
