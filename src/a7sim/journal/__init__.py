"""Journals of sessions: format, writer, checkpoints, replay, resume, recordings and scripts."""
