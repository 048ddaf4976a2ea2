"""What an engineer states: systems, modes, references, sets, constraints."""
