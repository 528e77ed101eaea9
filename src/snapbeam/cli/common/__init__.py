"""What commands share: options, the console, what they read and how they tell what they found."""
