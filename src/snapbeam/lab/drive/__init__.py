"""The vibrometer's record of the shaker, aligned with the camera's and made into a drive."""
