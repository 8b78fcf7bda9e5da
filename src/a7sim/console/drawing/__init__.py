"""Drawing in characters: eyepieces, drums, sketches, descriptions in words."""
