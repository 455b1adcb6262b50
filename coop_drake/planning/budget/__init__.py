"""Whether a plan holds under a budget of departures, and gains with which it does."""
