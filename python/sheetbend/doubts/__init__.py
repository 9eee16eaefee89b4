"""What follows from a minimum and what speaks against it: verdicts, predictions, contradictions, doubts."""
