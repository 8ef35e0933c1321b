"""Generic surrogates beside ours: same labels, same points, same share of them verified."""
