"""The campaigns whose results the documentation states, and the command that makes all of them again."""
