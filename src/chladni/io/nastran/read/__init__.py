"""From cards to an assembly and to what the deck asks for."""
