"""The Gymnasium environments in which policies are trained."""
