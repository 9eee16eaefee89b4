"""From a least-squares problem to its minimum, and what finer discretizations would change there."""
