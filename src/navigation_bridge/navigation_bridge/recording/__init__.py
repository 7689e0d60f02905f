"""Notes in recordings, recordings played again, goals worked on against them."""
