"""Measured responses beside simulated ones: classes, maps, waveforms."""
