"""Alternative explanations of an effect, and their evidence."""
