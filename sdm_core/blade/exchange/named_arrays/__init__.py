"""Archives of named arrays: MATLAB (.mat, version 5 and 7.3) and NumPy (.npz)."""
