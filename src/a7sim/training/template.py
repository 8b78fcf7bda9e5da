"""Template of a new exercise; `check-exercise` lists what is missing."""

from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.training.catalogue import FILE

GOAL = "State the task in one or two sentences."
TEXT = "State in plain words what the student learns and does."
FEEDBACK = "State how to do better."
HINT = "A small hint."
REMARK = "Describe the steps and their reasons."
PLACEHOLDERS = frozenset({GOAL, TEXT, FEEDBACK, HINT, REMARK})
"""Texts of the template that the author has to replace; `check-exercise` reports each that is left."""

_EXERCISE = """\
schema_version = 1
number = {number}
title = "{title}"
goal = "{goal}"
scenario = "akwanga"
minutes = 30
reference = {{ script = "reference.a7s" }}

# Actions at the instrument before the student starts; leave it out to start at zero.
[opening]
script = "opening.a7s"

# Values of the scenario by path, and values that each seed draws anew within a tolerance.
[settings]
"instrument.laying_sigma_mm" = 0.0
"instrument.laying_sigma_gon" = 0.0

[vary]
"photos.0.omega" = 0.05

[[step]]
text = "Register point 1 twice"
measure = "missing-readings"
options = {{ points = ["1"], each = 2 }}
done = 0

[[criterion]]
id = "complete"
title = "all readings are made"
measure = "missing-readings"
options = {{ points = ["1"], each = 2 }}
excellent = 0
pass = 0
weight = 50
feedback = "{feedback}"

[[criterion]]
id = "pointed"
title = "the mark is on the point"
measure = "beside-the-point"
options = {{ points = ["1"], eye = 1 }}
excellent = 12
pass = 30
weight = 50
feedback = "{feedback}"

# Two hints or more.
[[hint]]
text = "{hint}"
cost = 2

# Two faulty scripts or more, each with the criterion that must fail and the reason.
[[faulty]]
script = "faulty-once.a7s"
fails = "complete"
why = "Point 1 is registered only once."
"""

_OPENING = """\
scenario akwanga seed 1

*RST
BASE:BX 194.99
PHOT1:LOAD "101"
PROJ1:PDIS 152.66
PROJ1:KAPP 399.50;PHI 100.27;OMEG 99.03
DRIV:X 1.00;Y -2.00;Z -330.00
"""

_REFERENCE = f"""\
scenario akwanga seed 1

# {REMARK} `a7sim train start FOLDER --script reference.a7s` runs it.
REC "1011"
WHE:X -0.50
WHE:X 0.50
REC "1011"
"""

_FAULTY = """\
scenario akwanga seed 1

# By mistake point 1 is registered only once.
REC "1011"
"""


def write_template(folder: Path, number: int) -> Path:
    """Write the template of an exercise into a new folder and return it. Raises A7SimError if that fails."""
    title = folder.name.lstrip("0123456789-_").replace("-", " ").strip().capitalize() or "A new exercise"
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise A7SimError(f"{folder}: expected a folder that does not exist yet: {error.strerror}") from error
    escaped = title.replace("\\", "\\\\").replace('"', '\\"')
    texts = {
        FILE: _EXERCISE.format(number=number, title=escaped, goal=GOAL, feedback=FEEDBACK, hint=HINT),
        "text.md": f"# {title}\n\n{TEXT}\n",
        "opening.a7s": _OPENING,
        "reference.a7s": _REFERENCE,
        "faulty-once.a7s": _FAULTY,
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder
