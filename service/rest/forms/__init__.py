"""The forms a question and an answer may have: JSON, and npz and Arrow for many points."""
