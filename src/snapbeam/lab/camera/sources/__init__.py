"""Where frames come from: one small class per file format, all with the same few things."""
