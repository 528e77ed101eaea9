"""What follows a step: was the contact met or left in it, and what is kept of it, by the law of contact."""
