"""Drake plants of the team, and the component tree read from their collision geometry."""
