"""What the physicist writes down (beam, contact, shaker) and its reduction to N modes."""
