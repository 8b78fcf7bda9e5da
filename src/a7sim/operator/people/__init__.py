"""The operator as a person: skill, random draws, fatigue, slips, time and observation book."""
