"""Universal files (UFF, .unv): their datasets, the modes in them, and a blade from and to them."""
