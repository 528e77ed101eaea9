"""Photron recordings: headers (.cih, .cihx) and pixels (.mraw), read and written."""
