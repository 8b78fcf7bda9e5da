"""Methods of strip triangulation: independent models, comparator and A8."""
